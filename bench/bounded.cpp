#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "answers.hpp"
#include "cases.hpp"
#include "letters.hpp"
#include "model/random.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "report.hpp"

namespace palpate::bench {

namespace {

/// What the parts of `palpate-bench bounded` work on.
struct BoundedInputs {
  Device& device;
  const std::vector<Hypothesis>& letters;
  bool quick = false;

  int unknowns() const { return quick ? 3 : 20; }
  std::int64_t bins_in_all(const PoseLattice& lattice) const {
    return lattice.bins() * static_cast<std::int64_t>(letters.size());
  }
  Json facts() const {
    return {
        {"objects", letters.size()}, {"touches", touches_per_unknown}, {"unknowns", unknowns()}};
  }
};

// Each part adds its cases to the report and returns a record of every run.

constexpr std::uint64_t speed_seed = 1'400'000'000;

struct Size {
  PoseLattice lattice;
  int dense = 0;  ///< unknowns that the dense engine answers, too
  std::optional<double> most_ms = {};
  bool on_one_thread = false;  ///< `most_ms` holds for one thread
};

/// How many of the dense modes the bounded answers have too, by bin or by likelihood up to 1e-3
/// nats, by which the histogram's float32 may order two bins otherwise.
int same_modes(const Answers& bounded, const Answers& dense) {
  constexpr double one_likelihood = 1e-3;
  int same = 0;
  for (std::size_t i = 0; i < dense.estimates.size(); ++i) {
    const Mode& a = bounded.estimates[i].mode;
    const Mode& b = dense.estimates[i].mode;
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
    Answers answers;
    const double first_ms = 1e3 * seconds_of([&] {
                              posterior.emplace(inputs.letters, options);
                              answers.ask(*posterior, touches);
                            });
    posterior->reset();
    answers.ask(*posterior, touches);
    ms.push_back(first_ms - 1e3 * answers.seconds.back());
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
  const Answers all = answer_each(threaded, unknowns, true);
  const Answers one = answer_each(single, unknowns, true);
  PoseHistogram histogram(inputs.device, inputs.letters, {.lattice = size.lattice});
  const Answers dense = answer_each(
      histogram, std::span(unknowns).first(static_cast<std::size_t>(size.dense)), false);

  const auto goal = [&](bool on_one) {
    return size.most_ms && on_one == size.on_one_thread ? std::optional(at_most(*size.most_ms))
                                                        : std::nullopt;
  };
  Case measured{.name = fmt::format("speed {}", size_of(size.lattice)),
                .facts = inputs.facts(),
                .measurements = measurements_of(all, "all threads", bins, goal(false))};
  measured.facts["path"] = threaded.path();
  std::vector<Measurement>& rows = measured.measurements;
  rows.push_back({"one thread, median", one.median_ms(), "ms", goal(true)});
  rows.push_back({"tables, once", tables_ms, "ms", at_most(most_table_ms)});
  rows.push_back({"dense engine, median", dense.median_ms(), "ms"});
  rows.push_back({"dense over bounded, all threads", dense.median_ms() / all.median_ms(), "times"});
  rows.push_back(
      share_of("the dense engine's mode", same_modes(all, dense), dense.estimates.size()));
  report.add(measured);
  return {{"bins", size_of(size.lattice)}, {"bins_in_all", bins},
          {"path", threaded.path()},       {"host_bytes", threaded.host_bytes()},
          {"table_ms", tables_ms},         {"all_threads", all.record()},
          {"one_thread", one.record()},    {"dense_seconds", dense.seconds}};
}

constexpr std::uint64_t streaming_seed = 1'401'000'000;
constexpr double budget_s = 0.1;
constexpr double most_dropped_first = 1e-2;

/// Least share of the first touches whose dropped mass is small, in percent: 16 of 20.
constexpr double least_share_first = 80.0;

void add_case(const Answers& answers, const std::string& touches, std::int64_t bins,
              const std::optional<Goal>& median_ms, bool first, Report& report) {
  const std::vector<double> dropped = answers.certified(&Certificate::dropped_mass);
  Case measured{
      .name = "streaming, " + touches,
      .facts = {{"bins in all", bins}, {"answers", dropped.size()}},
      .measurements = measurements_of(answers, "from touch to estimate", bins, median_ms)};
  measured.measurements.push_back({"dropped mass, median", median(dropped), "mass"});
  const auto small = [&](double most) {
    return static_cast<int>(
        std::ranges::count_if(dropped, [most](double mass) { return mass <= most; }));
  };
  measured.measurements.push_back(
      first ? share_of(fmt::format("dropped mass at most {}", most_dropped_first),
                       small(most_dropped_first), dropped.size(), at_least(least_share_first))
            : share_of("dropped mass within the tolerance", small(BoundedOptions{}.tolerance),
                       dropped.size()));
  report.add(measured);
}

/// Nine touches in one update on lattices of 10^4 to 10^7 bins per object, beside the dense engine.
Json measure_bounded_speed(const BoundedInputs& inputs, Report& report) {
  const std::vector<Recording> unknowns =
      unknown_recordings(inputs.unknowns(), touches_per_unknown, speed_seed);
  Json records = Json::array();
  for (const Size& size : sizes_of(inputs)) {
    records.push_back(measure_size(inputs, size, unknowns, report));
  }
  return records;
}

/// The mode over the poses that scan matchers search, tables included and not.
Json measure_bounded_mode(const BoundedInputs& inputs, Report& report) {
  constexpr double most_ms = 6.0;
  constexpr double most_with_tables_ms = 40.0;
  // Steps of 0.5 mm and 1 degree.
  const PoseLattice lattice = inputs.quick ? lattice_of(10, 10, 12) : lattice_of(40, 40, 360);
  const std::vector<Recording> unknowns =
      unknown_recordings(inputs.unknowns(), touches_per_unknown, speed_seed);
  const std::int64_t bins = inputs.bins_in_all(lattice);
  const BoundedOptions options{.lattice = lattice};
  BoundedPosterior posterior(inputs.letters, options);
  const Answers answers = answer_each(posterior, unknowns, true);
  const double tables_ms = table_ms(inputs, options, unknowns.front());
  Case measured{.name = "mode " + size_of(lattice),
                .facts = inputs.facts(),
                .measurements = measurements_of(answers, "to the mode", bins, at_most(most_ms))};
  measured.measurements.push_back({"tables included, median", answers.median_ms() + tables_ms, "ms",
                                   at_most(most_with_tables_ms)});
  report.add(measured);
  return {{"bins", size_of(lattice)}, {"table_ms", tables_ms}, {"answers", answers.record()}};
}

/// Touch after touch, each with an estimate, the first within a budget.
Json measure_bounded_streaming(const BoundedInputs& inputs, Report& report) {
  const PoseLattice lattice = inputs.quick ? lattice_of(10, 10, 8) : lattice_of(200, 200, 250);
  const std::int64_t bins = inputs.bins_in_all(lattice);
  BoundedPosterior posterior(inputs.letters, {.lattice = lattice, .budget_s = budget_s});
  std::vector<Answers> after(touches_per_unknown);  // [touch]
  const std::vector<Recording> unknowns =
      unknown_recordings(inputs.unknowns(), touches_per_unknown, streaming_seed);
  Answers().ask(posterior, all_touches(unknowns.front()));  // warms up
  for (const Recording& unknown : unknowns) {
    posterior.reset();
    for (std::size_t i = 0; i < after.size(); ++i) {
      after[i].ask(posterior, unknown.touches(i, i + 1));
    }
  }
  Answers later;
  for (std::size_t i = 2; i < after.size(); ++i) {
    later.add(after[i]);
  }
  // The budget is for the search. The touch is taken in before.
  add_case(after[0], "touch 1", bins, at_most(1.1e3 * budget_s), true, report);
  add_case(after[1], "touch 2", bins, at_most(40.0), false, report);
  add_case(later, fmt::format("touches 3 to {}", after.size()), bins, at_most(20.0), false, report);
  Json records = Json::array();
  for (std::size_t i = 0; i < after.size(); ++i) {
    Json record{{"touch", i + 1}, {"bins_in_all", bins}, {"budget_s", budget_s}};
    record.update(after[i].record());
    records.push_back(std::move(record));
  }
  return records;
}

constexpr std::uint64_t large_seed = 1'402'000'000;

double mib(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

struct LargeScene {
  int objects = 0;
  double most_ms = 0.0;
  std::optional<double> most_mib = {};
  DisplacementSd touch_sd = {};  ///< by which touches are off, and which the posterior is told
};

/// Lets the robot say that the array was elsewhere, by normal numbers of its own for every touch.
void misplace(Recording& recording, const DisplacementSd& sd, std::uint64_t seed) {
  Random random(seed, Stream::pose_noise);
  for (Pose& pose : recording.T_robot_sensor) {
    Pose displaced;
    displaced.translation_mm.x = sd.mm * random.normal();
    displaced.translation_mm.y = sd.mm * random.normal();
    displaced.theta_rad = sd.rad * random.normal();
    pose = pose * displaced;
  }
}

/// The region about the pivot, in steps of 0.5 mm and 2 degrees.
PoseLattice lattice_over(double extent_mm, bool quick) {
  const int count = quick ? 20 : static_cast<int>(4.0 * extent_mm);
  const Axis axis{-extent_mm, extent_mm, count};
  return {.x_mm = axis, .y_mm = axis, .theta_rad = {0.0, 2.0 * std::numbers::pi, quick ? 12 : 180}};
}

/// `about_touches` turns theta about the first touch, as --pivot-mm auto; else about the robot
/// frame's origin, which then lies as far away as the region reaches.
Json measure_scene(const BoundedInputs& inputs, const LargeScene& scene, bool about_touches,
                   const std::vector<Hypothesis>& objects, Report& report) {
  const double extent_mm = inputs.quick ? 20.0 : 100.0;
  const PoseLattice lattice = lattice_over(extent_mm, inputs.quick);
  std::vector<Recording> unknowns =
      glyph_unknowns(scene.objects, inputs.unknowns(), touches_per_unknown, extent_mm, large_seed);
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    misplace(unknowns[i], scene.touch_sd, large_seed + i);
  }
  const auto bins = lattice.bins() * static_cast<std::int64_t>(objects.size());
  restart_peak_memory();
  const std::uint64_t before = resident_bytes();
  std::optional<BoundedPosterior> posterior;
  const double seconds = seconds_of([&] {
    posterior.emplace(objects, BoundedOptions{.lattice = lattice, .touch_sd = scene.touch_sd});
  });
  Answers answers;
  int right = 0;
  for (const Recording& unknown : unknowns) {
    posterior->reset();
    if (about_touches) {
      posterior->move_pivot(unknown.T_robot_sensor.front().translation_mm);
    }
    const std::vector<double> identity = answers.ask(*posterior, all_touches(unknown)).identity;
    const auto best = std::ranges::max_element(identity) - identity.begin();
    right += objects[static_cast<std::size_t>(best)].map.label == unknown.object ? 1 : 0;
  }
  const std::uint64_t peak = peak_resident_bytes() - before;
  const std::string pivot = about_touches ? "the first touch" : "the robot's origin";
  Case measured{
      .name = fmt::format("large, {} objects, {}pivot at {}", objects.size(),
                          scene.touch_sd.none() ? "" : "misplaced touches, ", pivot),
      .facts = {{"region", fmt::format("±{} mm, all angles", extent_mm)},
                {"bins", size_of(lattice)},
                {"bins in all", bins},
                {"touches", touches_per_unknown},
                {"unknowns", unknowns.size()}},
      .measurements = measurements_of(answers, "all threads", bins, at_most(scene.most_ms))};
  const auto most_mib = scene.most_mib ? std::optional(at_most(*scene.most_mib)) : std::nullopt;
  measured.measurements.push_back({"construction", 1e3 * seconds, "ms"});
  measured.measurements.push_back(
      {"held by the posterior", mib(posterior->host_bytes()), "MiB", most_mib});
  measured.measurements.push_back({"peak of the process above before", mib(peak), "MiB", most_mib});
  measured.measurements.push_back(share_of("object right", right, unknowns.size()));
  report.add(measured);
  return {{"objects", objects.size()},
          {"misplaced", !scene.touch_sd.none()},
          {"pivot", pivot},
          {"bins_in_all", bins},
          {"peak_bytes", peak},
          {"host_bytes", posterior->host_bytes()},
          {"answers", answers.record()}};
}

/// Many objects, far away, also by misplaced touches: time and memory.
Json measure_bounded_large(const BoundedInputs& inputs, Report& report) {
  constexpr DisplacementSd sd{1.0, 0.05};
  const std::vector<LargeScene> scenes =
      inputs.quick
          ? std::vector<LargeScene>{{3, 120.0, 200.0}, {3, 120.0, 200.0, sd}}
          : std::vector<LargeScene>{{20, 120.0, 200.0}, {100, 600.0}, {20, 3000.0, {}, sd}};
  Json records = Json::array();
  for (const LargeScene& scene : scenes) {
    const std::vector<Hypothesis> objects =
        letter_maps(inputs.device, glyph_recordings(scene.objects));
    for (const bool about_touches : {false, true}) {
      records.push_back(measure_scene(inputs, scene, about_touches, objects, report));
    }
  }
  return records;
}

}  // namespace

void measure_bounded(const RunOptions& options, std::span<char* const> command_line) {
  Report report(options, command_line);
  const std::vector<Hypothesis> letters = letter_maps(report.device(), training_recordings());
  const BoundedInputs inputs{report.device(), letters, options.quick};
  constexpr decltype(&measure_bounded_speed) measures[] = {
      measure_bounded_speed, measure_bounded_mode, measure_bounded_streaming, measure_bounded_large,
      [](const BoundedInputs& inputs, Report& /*report*/) {
        return search_by_bounds(inputs.letters, inputs.quick);
      }};
  static_assert(std::size(measures) == std::size(bounded_parts));
  for (std::size_t i = 0; i < std::size(measures); ++i) {
    if (options.part.empty() || options.part == bounded_parts[i]) {
      report.document()[bounded_parts[i]] = measures[i](inputs, report);
    }
  }
  report.write();
}

}  // namespace palpate::bench
