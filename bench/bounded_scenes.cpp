#include <algorithm>
#include <map>
#include <numbers>
#include <optional>
#include <tuple>

#include <fmt/format.h>

#include "bounded.hpp"
#include "letters.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t large_seed = 1'402'000'000;

double mib(std::uint64_t bytes) { return static_cast<double>(bytes) / (1 << 20); }

struct LargeScene {
  int objects = 0;
  double most_ms = 0.0;
  std::optional<double> most_mib = {};
};

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
  const std::vector<Recording> unknowns =
      glyph_unknowns(scene.objects, inputs.unknowns(), touches_per_unknown, extent_mm, large_seed);
  const auto bins = lattice.bins() * static_cast<std::int64_t>(objects.size());
  restart_peak_memory();
  const std::uint64_t before = resident_bytes();
  std::optional<BoundedPosterior> posterior;
  const double seconds =
      seconds_of([&] { posterior.emplace(objects, BoundedOptions{.lattice = lattice}); });
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
      .name = fmt::format("large, {} objects, pivot at {}", objects.size(), pivot),
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
  return {{"objects", objects.size()}, {"pivot", pivot},
          {"bins_in_all", bins},       {"host_bytes", posterior->host_bytes()},
          {"peak_bytes", peak},        {"answers", answers.record()}};
}

}  // namespace

Json measure_bounded_large(const BoundedInputs& inputs, Report& report) {
  const std::vector<LargeScene> scenes =
      inputs.quick ? std::vector<LargeScene>{{3, 120.0, 200.0}}
                   : std::vector<LargeScene>{{20, 120.0, 200.0}, {100, 600.0}};
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

Json measure_bounded_search(const BoundedInputs& inputs, Report& /*report*/) {
  // An A, whose first touch meets an edge of the letter, on bins all over the letters.
  constexpr std::uint64_t seed = 1'405'000'018;
  constexpr double extent_mm = 15.0;
  const Recording unknown = unknown_recordings(1, touches_per_unknown, seed).front();
  PoseLattice lattice = inputs.quick ? lattice_of(20, 20, 16) : lattice_of(200, 200, 250);
  lattice.x_mm = {-extent_mm, extent_mm, lattice.x_mm.count};
  lattice.y_mm = lattice.x_mm;
  // As --pivot-mm auto: x and y are where the first touch lies on the letter.
  lattice.pivot_mm = unknown.T_robot_sensor.front().translation_mm;
  const glm::dvec2 place_mm = unknown.truth->T_object_robot * lattice.pivot_mm;
  BoundedPosterior posterior(inputs.letters, {.lattice = lattice});
  Json stages = Json::array();
  std::size_t done = 0;
  for (const std::size_t touches : {std::size_t{1}, std::size_t{3}, std::size_t{9}}) {
    posterior.update(unknown.touches(done, touches));
    done = touches;
    std::map<std::tuple<int, int, int, int, int>, int> thetas;  // by level and place
    for (const PoseBlock& b : posterior.refined_blocks()) {
      if (b.object == 0) {
        ++thetas[{b.level, b.x_first, b.x_count, b.y_first, b.y_count}];
      }
    }
    Json blocks = Json::array();
    for (const auto& [at, count] : thetas) {
      const auto& [level, x, nx, y, ny] = at;
      blocks.push_back({level, x, nx, y, ny, count});
    }
    stages.push_back({{"touches", touches},
                      {"bins_evaluated", posterior.estimate().certificate->bins_evaluated},
                      {"blocks", blocks}});
  }
  return {{"bins", {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count}},
          {"bins_in_all", inputs.bins_in_all(lattice)},
          {"extent_mm", extent_mm},
          {"place_mm", {place_mm.x, place_mm.y}},
          {"stages", stages}};
}

}  // namespace palpate::bench
