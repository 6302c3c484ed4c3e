#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "bounded_answers.hpp"
#include "dense_posterior.hpp"
#include "letters.hpp"
#include "recognition/recognition_task.hpp"
#include "sweep_document.hpp"
#include "sweep_measurements.hpp"

namespace palpate::bench {

namespace {

/// Seconds per unknown, [trial].
struct UnknownSeconds {
  std::vector<double> once = {};        ///< all touches in one update, and one estimate
  std::vector<double> each_touch = {};  ///< an estimate after every touch
};

/// Times `filter`, which has update() and estimate(), over one more unknown.
template <typename Filter>
void time_unknown(Filter& filter, const Recording& trial, UnknownSeconds& seconds) {
  filter.reset();
  seconds.each_touch.push_back(seconds_of([&] {
    for (std::size_t i = 0; i < trial.size(); ++i) {
      filter.update(trial.touch(i));
      filter.estimate();
    }
  }));
  const std::vector<Touch> touches = all_touches(trial);
  filter.reset();
  seconds.once.push_back(seconds_of([&] {
    filter.update(touches);
    filter.estimate();
  }));
}

/// The first of the lattices from which on the bounded posterior is faster.
std::size_t first_faster(const Json& bounds, const std::string& field) {
  std::size_t first = bounds.size();
  while (first > 0 &&
         bounds[first - 1].at("bounded").at(field) < bounds[first - 1].at("histogram").at(field)) {
    --first;
  }
  return first;
}

/// The bins in all from which on the bounded posterior is faster, by straight lines between the
/// logarithms of bins and times; null where it is faster on all lattices or not on the last.
Json crossing_of(const Json& bounds, const std::string& field) {
  const std::size_t first = first_faster(bounds, field);
  if (first == 0 || first == bounds.size()) {
    return nullptr;
  }
  const auto excess = [&](const Json& record) {
    return std::log(record.at("bounded").at(field).get<double>() /
                    record.at("histogram").at(field).get<double>());
  };
  const double before = excess(bounds[first - 1]);
  const double share = before / (before - excess(bounds[first]));
  const double lower = std::log(bounds[first - 1].at("bins_in_all").get<double>());
  const double upper = std::log(bounds[first].at("bins_in_all").get<double>());
  return std::exp(lower + share * (upper - lower));
}

std::string crossing_text(const Json& bounds, const std::string& field) {
  const Json crossing = crossing_of(bounds, field);
  return !crossing.is_null() ? fmt::format("from {} bins in all on", count_text(crossing))
         : first_faster(bounds, field) == 0 ? "on all of these lattices"
                                            : "on none of these lattices";
}

}  // namespace

Json measure_bounds(Device& device, const std::vector<Hypothesis>& letters,
                    std::span<const Recording> trials, const BinCounts& bins) {
  const PoseLattice lattice = lattice_with(bins);
  BoundedPosterior bounded(letters, {.lattice = lattice});
  PoseHistogram histogram(device, letters, {.lattice = lattice});
  UnknownSeconds of_bounded;
  UnknownSeconds of_histogram;
  answer(bounded, all_touches(trials.front()));  // warms up
  histogram.update(trials.front().touch(0));
  std::vector<double> evaluated;
  double certificate = 0.0;
  double measured = 0.0;
  int holding = 0;
  int same_modes = 0;
  for (const Recording& trial : trials) {
    time_unknown(bounded, trial, of_bounded);
    time_unknown(histogram, trial, of_histogram);
    const CertificateCheck check = check_certificate(
        bounded, dense_posterior(histogram, letters, ContactModel{}, all_touches(trial)));
    evaluated.push_back(static_cast<double>(bounded.estimate().certificate->bins_evaluated));
    certificate = std::max(certificate, check.promised);
    measured = std::max(measured, check.measured());
    holding += check.holds() ? 1 : 0;
    same_modes += check.same_mode ? 1 : 0;
  }
  const auto record_of = [](const UnknownSeconds& seconds) {
    return Json{{"once", median(seconds.once)}, {"each_touch", median(seconds.each_touch)}};
  };
  const std::int64_t in_all = lattice.bins() * static_cast<std::int64_t>(letters.size());
  const bool takes_bounded = in_all > most_histogram_bins;
  const Json seconds_histogram = record_of(of_histogram);
  const Json seconds_bounded = record_of(of_bounded);
  const bool faster_bounded = seconds_bounded.at("once") < seconds_histogram.at("once");
  return {{"cell_mm", letters.front().map.cell_mm},
          {"count", lattice.bins()},
          {"bins", bins},
          {"bins_in_all", in_all},
          {"trials", trials.size()},
          {"histogram", seconds_histogram},
          {"bounded", seconds_bounded},
          {"bins_evaluated", median(evaluated)},
          {"share_evaluated", median(evaluated) / static_cast<double>(in_all)},
          {"certificate", certificate},
          {"measured_error", measured},
          {"certificates_hold", holding},
          {"same_modes", same_modes},
          {"host_bytes", bounded.host_bytes()},
          {"auto", takes_bounded ? "bounded" : "histogram"},
          {"auto_is_faster", takes_bounded == faster_bounded},
          {"path", bounded.path()}};
}

Json auto_rule_of(const Json& bounds) {
  return {{"once", crossing_of(bounds, "once")},
          {"each_touch", crossing_of(bounds, "each_touch")},
          {"rule", most_histogram_bins},
          {"sentence",
           fmt::format("The bounded posterior answers sooner than the histogram {} where it is "
                       "asked once, and {} where it is asked after each of {} touches; --filter "
                       "auto takes it above {} bins in all.",
                       crossing_text(bounds, "once"), crossing_text(bounds, "each_touch"),
                       touches_per_trial, count_text(most_histogram_bins))}};
}

}  // namespace palpate::bench
