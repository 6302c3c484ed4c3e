#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "bounded.hpp"
#include "letters.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t speed_seed = 1'400'000'000;

struct Size {
  PoseLattice lattice;
  int dense = 0;  ///< unknowns that the dense engine answers, too
  std::optional<double> most_ms = {};
  bool on_one_thread = false;  ///< `most_ms` holds for one thread
};

/// How many of the dense modes the bounded answers have too, by bin or by likelihood up to 1e-3
/// nats, by which the histogram's float32 may order two bins otherwise.
int same_modes(const BoundedAnswers& bounded, const DenseAnswers& dense) {
  constexpr double one_likelihood = 1e-3;
  int same = 0;
  for (std::size_t i = 0; i < dense.modes.size(); ++i) {
    const Mode& a = bounded.modes[i];
    const Mode& b = dense.modes[i];
    const bool one_bin = a.object == b.object && a.bin == b.bin;
    same += one_bin || std::abs(a.log_likelihood - b.log_likelihood) < one_likelihood ? 1 : 0;
  }
  return same;
}

/// Median milliseconds by which a new posterior's first answer takes longer than the same answer
/// after reset(): what the tables cost, whenever they are built.
double table_ms(const BoundedInputs& inputs, const BoundedOptions& options,
                const Recording& unknown) {
  constexpr int repeats = 5;
  const std::vector<Touch> touches = all_touches(unknown);
  std::vector<double> ms;
  for (int i = 0; i < repeats; ++i) {
    std::optional<BoundedPosterior> posterior;
    BoundedAnswers answers;
    const double first_ms = 1e3 * seconds_of([&] {
                              posterior.emplace(inputs.letters, options);
                              answers.ask(*posterior, touches);
                            });
    posterior->reset();
    answers.ask(*posterior, touches);
    ms.push_back(first_ms - answers.milliseconds.back());
  }
  return median(ms);
}

std::vector<Size> sizes_of(const BoundedInputs& inputs) {
  if (inputs.quick) {
    return {{lattice_of(5, 5, 4), 3}, {lattice_of(10, 10, 10), 3}};
  }
  return {{lattice_of(25, 25, 16), 20, 2.0, true},
          {lattice_of(100, 100, 100), 20, 8.0},
          {lattice_of(200, 200, 250), 2, 20.0}};
}

Json measure_size(const BoundedInputs& inputs, const Size& size,
                  const std::vector<Recording>& unknowns, Report& report) {
  constexpr double most_table_ms = 30.0;
  const BoundedOptions options{.lattice = size.lattice};
  BoundedOptions one_thread = options;
  one_thread.threads = 1;
  const std::int64_t bins = inputs.bins_in_all(size.lattice);
  const double tables_ms = table_ms(inputs, options, unknowns.front());
  BoundedPosterior threaded(inputs.letters, options);
  BoundedPosterior single(inputs.letters, one_thread);
  const BoundedAnswers all = answer_each(threaded, unknowns);
  const BoundedAnswers one = answer_each(single, unknowns);
  PoseHistogram histogram(inputs.device, inputs.letters, {.lattice = size.lattice});
  const DenseAnswers dense =
      answer_each(histogram, std::span(unknowns).first(static_cast<std::size_t>(size.dense)));

  const auto goal = [&](bool on_one) {
    return size.most_ms && on_one == size.on_one_thread ? std::optional(at_most(*size.most_ms))
                                                        : std::nullopt;
  };
  const double dense_ms = 1e3 * median(dense.seconds);
  Case measured{.name = fmt::format("speed {}", size_of(size.lattice)),
                .facts = {{"objects", inputs.letters.size()},
                          {"touches", touches_per_unknown},
                          {"unknowns", unknowns.size()},
                          {"path", threaded.path()}},
                .measurements = measurements_of(all, "all threads", bins, goal(false))};
  std::vector<Measurement>& rows = measured.measurements;
  rows.push_back({"one thread, median", median(one.milliseconds), "ms", goal(true)});
  rows.push_back({"tables, once", tables_ms, "ms", at_most(most_table_ms)});
  rows.push_back({"dense engine, median", dense_ms, "ms"});
  rows.push_back({"dense over bounded, all threads", dense_ms / median(all.milliseconds), "times"});
  rows.push_back(share_of("the dense engine's mode", same_modes(all, dense), dense.modes.size()));
  report.add(measured);
  return {{"bins", size_of(size.lattice)}, {"bins_in_all", bins},
          {"path", threaded.path()},       {"host_bytes", threaded.host_bytes()},
          {"table_ms", tables_ms},         {"all_threads", all.record()},
          {"one_thread", one.record()},    {"dense_seconds", dense.seconds}};
}

}  // namespace

Json measure_bounded_speed(const BoundedInputs& inputs, Report& report) {
  const std::vector<Recording> unknowns =
      unknown_recordings(inputs.unknowns(), touches_per_unknown, speed_seed);
  Json records = Json::array();
  for (const Size& size : sizes_of(inputs)) {
    records.push_back(measure_size(inputs, size, unknowns, report));
  }
  return records;
}

Json measure_bounded_mode(const BoundedInputs& inputs, Report& report) {
  constexpr double most_ms = 6.0;
  constexpr double most_with_tables_ms = 40.0;
  // Steps of 0.5 mm and 1 degree.
  const PoseLattice lattice = inputs.quick ? lattice_of(10, 10, 12) : lattice_of(40, 40, 360);
  const std::vector<Recording> unknowns =
      unknown_recordings(inputs.unknowns(), touches_per_unknown, speed_seed);
  const std::int64_t bins = inputs.bins_in_all(lattice);
  Json records = Json::array();
  for (const double tolerance : {BoundedOptions{}.tolerance, 0.1}) {
    const BoundedOptions options{.lattice = lattice, .tolerance = tolerance};
    BoundedPosterior posterior(inputs.letters, options);
    const BoundedAnswers answers = answer_each(posterior, unknowns);
    const double tables_ms = table_ms(inputs, options, unknowns.front());
    const double ms = median(answers.milliseconds);
    Case measured{.name = fmt::format("mode {}, tolerance {}", size_of(lattice), tolerance),
                  .facts = {{"objects", inputs.letters.size()},
                            {"touches", touches_per_unknown},
                            {"unknowns", unknowns.size()}},
                  .measurements = measurements_of(answers, "to the mode", bins, at_most(most_ms))};
    measured.measurements.push_back(
        {"tables included, median", ms + tables_ms, "ms", at_most(most_with_tables_ms)});
    report.add(measured);
    records.push_back({{"bins", size_of(lattice)},
                       {"tolerance", tolerance},
                       {"table_ms", tables_ms},
                       {"answers", answers.record()}});
  }
  return records;
}

}  // namespace palpate::bench
