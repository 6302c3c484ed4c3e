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

#include "cases.hpp"
#include "letters.hpp"
#include "model/random.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/estimate.hpp"
#include "palpate/pose_histogram.hpp"
#include "report.hpp"

namespace palpate::bench {

namespace {

/// What the parts of `palpate-bench bounded` work on. Each part adds its cases to the report and
/// returns a record of every run.
struct BoundedInputs {
  Device& device;
  std::vector<Hypothesis> letters;
  bool quick = false;

  int unknowns() const { return quick ? 3 : 20; }
  std::int64_t bins_in_all(const PoseLattice& lattice) const {
    return lattice.bins() * static_cast<std::int64_t>(letters.size());
  }
  std::vector<Recording> recordings(std::uint64_t seed) const {
    return unknown_recordings(unknowns(), touches_per_unknown, seed);
  }
  Json facts() const {
    return {
        {"objects", letters.size()}, {"touches", touches_per_unknown}, {"unknowns", unknowns()}};
  }
};

/// Answers of a belief, [unknown], and what they took.
struct Answers {
  std::vector<double> seconds = {};  ///< of update() and estimate()
  std::vector<Estimate> estimates = {};

  /// Takes in the touches and asks once; what was known before counts too.
  template <typename Belief>
  const Estimate& ask(Belief& belief, std::span<const Touch> touches) {
    Estimate& estimate = estimates.emplace_back();
    seconds.push_back(seconds_of([&] {
      belief.update(touches);
      estimate = belief.estimate();
    }));
    return estimate;
  }
  void add(const Answers& others) {
    seconds.insert(seconds.end(), others.seconds.begin(), others.seconds.end());
    estimates.insert(estimates.end(), others.estimates.begin(), others.estimates.end());
  }
  double median_ms() const { return 1e3 * median(seconds); }
  /// A number of the certificates, which bounds alone have.
  template <typename Number>
  std::vector<double> certified(Number Certificate::*number) const {
    std::vector<double> numbers;
    for (const Estimate& estimate : estimates) {
      numbers.push_back(static_cast<double>((*estimate.certificate).*number));
    }
    return numbers;
  }
  int modes_certain() const {
    return static_cast<int>(std::ranges::count(certified(&Certificate::mode_certain), 1.0));
  }
  /// The figures of every answer by bounds, [unknown] each.
  Json record() const {
    std::vector<double> milliseconds = seconds;
    std::ranges::for_each(milliseconds, [](double& s) { s *= 1e3; });
    return {{"milliseconds", milliseconds},
            {"bins_evaluated", certified(&Certificate::bins_evaluated)},
            {"dropped_mass", certified(&Certificate::dropped_mass)},
            {"mode_certain", modes_certain()}};
  }
};

/// Asks once about each unknown after all of its touches, from the uniform belief on.
/// @param warm_up asks about the first unknown once more before, which does not count
template <typename Belief>
Answers answer_each(Belief& belief, std::span<const Recording> unknowns, bool warm_up) {
  belief.reset();
  if (warm_up) {
    Answers().ask(belief, all_touches(unknowns.front()));
  }
  Answers answers;
  for (const Recording& unknown : unknowns) {
    belief.reset();
    answers.ask(belief, all_touches(unknown));
  }
  return answers;
}

/// Rows of times, bins evaluated and certificate. `name` begins the names of the times.
std::vector<Measurement> measurements_of(const Answers& answers, const std::string& name,
                                         std::int64_t bins_in_all, std::optional<Goal> median_ms) {
  const double evaluated = median(answers.certified(&Certificate::bins_evaluated));
  return {{name + ", median", answers.median_ms(), "ms", median_ms},
          {name + ", least", 1e3 * std::ranges::min(answers.seconds), "ms"},
          {name + ", most", 1e3 * std::ranges::max(answers.seconds), "ms"},
          {"bins evaluated, median", evaluated, "bins"},
          {"of all bins", 100.0 * evaluated / static_cast<double>(bins_in_all), "%"},
          {"certificate, largest", std::ranges::max(answers.certified(&Certificate::dropped_mass)),
           "mass"},
          share_of("mode certain", answers.modes_certain(), answers.estimates.size())};
}

constexpr std::uint64_t speed_seed = 1'400'000'000;
constexpr std::uint64_t streaming_seed = 1'401'000'000;
constexpr std::uint64_t large_seed = 1'402'000'000;

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
double table_ms(const BoundedInputs& inputs, const PoseLattice& lattice, const Recording& unknown) {
  constexpr int repeats = 5;
  const std::vector<Touch> touches = all_touches(unknown);
  std::vector<double> ms;
  for (int i = 0; i < repeats; ++i) {
    std::optional<BoundedPosterior> posterior;
    Answers answers;
    const double first_s = seconds_of([&] {
      posterior.emplace(inputs.letters, BoundedOptions{.lattice = lattice});
      answers.ask(*posterior, touches);
    });
    posterior->reset();
    answers.ask(*posterior, touches);
    ms.push_back(1e3 * (first_s - answers.seconds.back()));
  }
  return median(ms);
}

/// Nine touches in one update on lattices of 10^4 to 10^7 bins per object, beside the dense engine.
Json measure_bounded_speed(const BoundedInputs& inputs, Report& report) {
  constexpr double most_table_ms = 30.0;
  struct Size {
    PoseLattice lattice;
    std::size_t dense;  ///< unknowns that the dense engine answers, too
    std::optional<Goal> all_threads = {};
    std::optional<Goal> one_thread = {};
  };
  const std::vector<Size> sizes =
      inputs.quick ? std::vector<Size>{{lattice_of(5, 5, 4), 3}, {lattice_of(10, 10, 10), 3}}
                   : std::vector<Size>{{lattice_of(25, 25, 16), 20, {}, at_most(2.0)},
                                       {lattice_of(100, 100, 100), 20, at_most(8.0)},
                                       {lattice_of(200, 200, 250), 2, at_most(20.0)}};
  const std::vector<Recording> unknowns = inputs.recordings(speed_seed);
  Json records = Json::array();
  for (const Size& size : sizes) {
    const double tables_ms = table_ms(inputs, size.lattice, unknowns.front());
    BoundedPosterior threaded(inputs.letters, {.lattice = size.lattice});
    BoundedPosterior single(inputs.letters, {.lattice = size.lattice, .threads = 1});
    const Answers all = answer_each(threaded, unknowns, true);
    const Answers one = answer_each(single, unknowns, true);
    PoseHistogram histogram(inputs.device, inputs.letters, {.lattice = size.lattice});
    const Answers dense = answer_each(histogram, std::span(unknowns).first(size.dense), false);
    const double ratio = dense.median_ms() / all.median_ms();
    Case measured{.name = "speed " + size_of(size.lattice),
                  .facts = inputs.facts(),
                  .measurements = measurements_of(
                      all, "all threads", inputs.bins_in_all(size.lattice), size.all_threads)};
    measured.facts["path"] = threaded.path();
    measured.add(
        {{"one thread, median", one.median_ms(), "ms", size.one_thread},
         {"tables, once", tables_ms, "ms", at_most(most_table_ms)},
         {"dense engine, median", dense.median_ms(), "ms"},
         {"dense over bounded, all threads", ratio, "times"},
         share_of("the dense engine's mode", same_modes(all, dense), dense.estimates.size())});
    report.add(measured);
    records.push_back({{"bins", size_of(size.lattice)},
                       {"all_threads", all.record()},
                       {"one_thread", one.record()},
                       {"dense_seconds", dense.seconds}});
  }
  return records;
}

/// The mode over the poses that scan matchers search, tables included and not.
Json measure_bounded_mode(const BoundedInputs& inputs, Report& report) {
  constexpr double most_ms = 6.0;
  constexpr double most_with_tables_ms = 40.0;
  // Steps of 0.5 mm and 1 degree.
  const PoseLattice lattice = inputs.quick ? lattice_of(10, 10, 12) : lattice_of(40, 40, 360);
  const std::vector<Recording> unknowns = inputs.recordings(speed_seed);
  BoundedPosterior posterior(inputs.letters, {.lattice = lattice});
  const Answers answers = answer_each(posterior, unknowns, true);
  const double with_tables_ms = answers.median_ms() + table_ms(inputs, lattice, unknowns.front());
  Case measured{.name = "mode " + size_of(lattice),
                .facts = inputs.facts(),
                .measurements = measurements_of(answers, "to the mode", inputs.bins_in_all(lattice),
                                                at_most(most_ms))};
  measured.add({{"tables included, median", with_tables_ms, "ms", at_most(most_with_tables_ms)}});
  report.add(measured);
  return {{"bins", size_of(lattice)}, {"answers", answers.record()}};
}

/// Touch after touch, each with an estimate, the first within a budget.
Json measure_bounded_streaming(const BoundedInputs& inputs, Report& report) {
  constexpr double budget_s = 0.1;
  constexpr double most_dropped_first = 1e-2;
  constexpr double least_share_first = 80.0;  // percent: of 16 of 20
  const PoseLattice lattice = inputs.quick ? lattice_of(10, 10, 8) : lattice_of(200, 200, 250);
  BoundedPosterior posterior(inputs.letters, {.lattice = lattice, .budget_s = budget_s});
  std::vector<Answers> after(touches_per_unknown);  // [touch]
  const std::vector<Recording> unknowns = inputs.recordings(streaming_seed);
  Answers().ask(posterior, all_touches(unknowns.front()));  // warms up
  for (const Recording& unknown : unknowns) {
    posterior.reset();
    for (std::size_t i = 0; i < after.size(); ++i) {
      after[i].ask(posterior, unknown.touches(i, i + 1));
    }
  }
  Answers later;
  Json records = Json::array();
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (i >= 2) {
      later.add(after[i]);
    }
    records.push_back({{"touch", i + 1}, {"budget_s", budget_s}});
    records.back().update(after[i].record());
  }
  const auto add_case = [&](const Answers& answers, const std::string& touches, double most_ms) {
    const std::vector<double> dropped = answers.certified(&Certificate::dropped_mass);
    const std::int64_t bins = inputs.bins_in_all(lattice);
    Case measured{
        .name = "streaming, " + touches,
        .facts = {{"bins in all", bins}, {"answers", dropped.size()}},
        .measurements = measurements_of(answers, "from touch to estimate", bins, at_most(most_ms))};
    const bool first = &answers == &after.front();
    const double most = first ? most_dropped_first : BoundedOptions{}.tolerance;
    const auto small = std::ranges::count_if(dropped, [&](double mass) { return mass <= most; });
    measured.add({{"dropped mass, median", median(dropped), "mass"},
                  share_of(first ? fmt::format("dropped mass at most {}", most)
                                 : "dropped mass within the tolerance",
                           static_cast<int>(small), dropped.size(),
                           first ? std::optional(at_least(least_share_first)) : std::nullopt)});
    report.add(measured);
  };
  // The budget is for the search. The touch is taken in before.
  add_case(after[0], "touch 1", 1.1e3 * budget_s);
  add_case(after[1], "touch 2", 40.0);
  add_case(later, fmt::format("touches 3 to {}", after.size()), 20.0);
  return records;
}

struct LargeScene {
  int objects = 0;
  double most_ms = 0.0;
  std::optional<Goal> memory_mib = {};
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

/// Bins of 0.5 mm and 2 degrees about the pivot. `about_touches` turns theta about the first touch,
/// as --pivot-mm auto; else about the robot frame's origin, which then lies as far away as the
/// region reaches.
Json measure_scene(const BoundedInputs& inputs, const LargeScene& scene, bool about_touches,
                   const std::vector<Hypothesis>& objects, Report& report) {
  const double extent_mm = inputs.quick ? 20.0 : 100.0;
  const Axis axis{-extent_mm, extent_mm, inputs.quick ? 20 : static_cast<int>(4.0 * extent_mm)};
  const PoseLattice lattice{.x_mm = axis,
                            .y_mm = axis,
                            .theta_rad = {0.0, 2.0 * std::numbers::pi, inputs.quick ? 12 : 180}};
  const std::int64_t bins = lattice.bins() * scene.objects;
  std::vector<Recording> unknowns =
      glyph_unknowns(scene.objects, inputs.unknowns(), touches_per_unknown, extent_mm, large_seed);
  restart_peak_memory();
  const std::uint64_t before = resident_bytes();
  std::optional<BoundedPosterior> posterior;
  const double seconds = seconds_of([&] {
    posterior.emplace(objects, BoundedOptions{.lattice = lattice, .touch_sd = scene.touch_sd});
  });
  Answers answers;
  int right = 0;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    misplace(unknowns[i], scene.touch_sd, large_seed + i);
    posterior->reset();
    if (about_touches) {
      posterior->move_pivot(unknowns[i].T_robot_sensor.front().translation_mm);
    }
    const std::vector<double> identity = answers.ask(*posterior, all_touches(unknowns[i])).identity;
    const auto best = std::ranges::max_element(identity) - identity.begin();
    right += objects[static_cast<std::size_t>(best)].map.label == unknowns[i].object ? 1 : 0;
  }
  const auto mib = [](std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); };
  const double peak_mib = mib(peak_resident_bytes() - before);
  const std::string pivot = about_touches ? "the first touch" : "the robot's origin";
  const bool misplaced = !scene.touch_sd.none();
  Case measured{
      .name = fmt::format("large, {} objects, {}pivot at {}", objects.size(),
                          misplaced ? "misplaced touches, " : "", pivot),
      .facts = {{"region", fmt::format("±{} mm, all angles", extent_mm)},
                {"bins", size_of(lattice)},
                {"bins in all", bins},
                {"touches", touches_per_unknown},
                {"unknowns", unknowns.size()}},
      .measurements = measurements_of(answers, "all threads", bins, at_most(scene.most_ms))};
  measured.add({{"construction", 1e3 * seconds, "ms"},
                {"held by the posterior", mib(posterior->host_bytes()), "MiB", scene.memory_mib},
                {"peak of the process above before", peak_mib, "MiB", scene.memory_mib},
                share_of("object right", right, unknowns.size())});
  report.add(measured);
  return {{"objects", objects.size()},
          {"misplaced", misplaced},
          {"pivot", pivot},
          {"host_bytes", posterior->host_bytes()},
          {"answers", answers.record()}};
}

/// Many objects, far away, also by misplaced touches: time and memory.
Json measure_bounded_large(const BoundedInputs& inputs, Report& report) {
  constexpr DisplacementSd sd{1.0, 0.05};
  const Goal mib = at_most(200.0);
  const std::vector<LargeScene> scenes =
      inputs.quick ? std::vector<LargeScene>{{3, 120.0, mib}, {3, 120.0, mib, sd}}
                   : std::vector<LargeScene>{{20, 120.0, mib}, {100, 600.0}, {20, 3000.0, {}, sd}};
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
  const BoundedInputs inputs{report.device(), letter_maps(report.device(), training_recordings()),
                             options.quick};
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
