#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "bounded.hpp"
#include "letters.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t growth_seed = 1'403'000'000;
constexpr double most_growth = 10.0;       ///< in time, for a thousand times the bins
constexpr double most_memory_mib = 256.0;  ///< of 10^9 bins

/// A lattice of some number of bins, in the proportions of 200 x 200 x 250.
PoseLattice lattice_of_bins(double count) {
  const double factor = std::cbrt(count / (4.0 * 4.0 * 5.0));
  const auto times = [factor](double n) {
    return std::max(1, static_cast<int>(std::lround(n * factor)));
  };
  return lattice_of(times(4.0), times(4.0), times(5.0));
}

/// Unknowns that the dense engine can answer in the time of a benchmark.
int dense_unknowns(double bins_in_all, int unknowns) {
  return bins_in_all <= 2e6   ? unknowns
         : bins_in_all <= 2e7 ? std::min(unknowns, 5)
         : bins_in_all <= 2e8 ? 1
                              : 0;
}

/// Median, least and most of some times in seconds; `unit` is the seconds that a 1 stands for.
Json times_of(const std::vector<double>& times, double unit) {
  return times.empty() ? Json(nullptr)
                       : Json{{"median", unit * median(times)},
                              {"least", unit * std::ranges::min(times)},
                              {"most", unit * std::ranges::max(times)},
                              {"unknowns", times.size()}};
}

Json measure_bins(const BoundedInputs& inputs, double bins_in_all,
                  const std::vector<Recording>& unknowns, Report& report) {
  const PoseLattice lattice =
      lattice_of_bins(bins_in_all / static_cast<double>(inputs.letters.size()));
  const std::int64_t bins = inputs.bins_in_all(lattice);
  BoundedOptions options{.lattice = lattice};
  restart_peak_memory();
  const std::uint64_t before = resident_bytes();
  std::optional<BoundedPosterior> posterior(std::in_place, inputs.letters, options);
  const BoundedAnswers all = answer_each(*posterior, unknowns);
  const std::uint64_t peak = peak_resident_bytes() - before;
  const std::uint64_t held = posterior->host_bytes();
  options.threads = 1;
  posterior.emplace(inputs.letters, options);
  const BoundedAnswers one = answer_each(*posterior, unknowns);
  posterior.reset();
  DenseAnswers dense;
  if (const int count = dense_unknowns(bins_in_all, static_cast<int>(unknowns.size())); count > 0) {
    PoseHistogram histogram(inputs.device, inputs.letters, {.lattice = lattice});
    histogram.update(unknowns.front().touch(0));  // warms up
    dense = answer_each(histogram, std::span(unknowns).first(static_cast<std::size_t>(count)));
  }

  const double peak_mib = static_cast<double>(peak) / (1 << 20);
  const bool largest = bins_in_all > 5e8;
  Case measured{.name = fmt::format("growth, {} bins in all", count_text(bins_in_all)),
                .facts = {{"bins", size_of(lattice)},
                          {"objects", inputs.letters.size()},
                          {"touches", touches_per_unknown},
                          {"unknowns", unknowns.size()}},
                .measurements = measurements_of(all, "all threads", bins)};
  measured.measurements.push_back({"one thread, median", median(one.milliseconds), "ms"});
  measured.measurements.push_back(
      {"peak of the process above before", peak_mib, "MiB",
       largest ? std::optional(at_most(most_memory_mib)) : std::nullopt});
  if (!dense.seconds.empty()) {
    measured.measurements.push_back(
        {fmt::format("dense engine, median of {}", dense.seconds.size()),
         1e3 * median(dense.seconds), "ms"});
  }
  report.add(measured);
  return {{"bins_in_all", bins},
          {"bins", size_of(lattice)},
          {"bounded", times_of(all.milliseconds, 1e-3)},
          {"one_thread", times_of(one.milliseconds, 1e-3)},
          {"dense", times_of(dense.seconds, 1.0)},
          {"bins_evaluated", median(all.bins_evaluated)},
          {"dropped_mass", std::ranges::max(all.dropped_mass)},
          {"host_bytes", held},
          {"peak_bytes", peak}};
}

/// Time for a thousand times the bins, from every lattice that has such a finer one.
void add_growth(const Json& records, Report& report) {
  Case measured{.name = "growth, a thousand times the bins"};
  for (std::size_t i = 0; i + 3 < records.size(); ++i) {
    const Json& few = records[i];
    const Json& many = records[i + 3];
    const auto ratio = [&](const char* threads) {
      return many.at(threads).at("median").get<double>() /
             few.at(threads).at("median").get<double>();
    };
    const std::string name = fmt::format("{} to {} bins", count_text(few.at("bins_in_all")),
                                         count_text(many.at("bins_in_all")));
    measured.measurements.push_back(
        {name + ", all threads", ratio("bounded"), "times", at_most(most_growth)});
    measured.measurements.push_back({name + ", one thread", ratio("one_thread"), "times"});
  }
  report.add(measured);
}

}  // namespace

Json measure_bounded_growth(const BoundedInputs& inputs, Report& report) {
  const std::vector<double> totals =
      inputs.quick ? std::vector{10.0, 1e2, 1e3, 1e4} : std::vector{1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
  const std::vector<Recording> unknowns =
      unknown_recordings(inputs.unknowns(), touches_per_unknown, growth_seed);
  Json records = Json::array();
  for (const double total : totals) {
    records.push_back(measure_bins(inputs, total, unknowns, report));
  }
  add_growth(records, report);
  return records;
}

}  // namespace palpate::bench
