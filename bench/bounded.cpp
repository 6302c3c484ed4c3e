#include "bounded.hpp"

#include <map>
#include <tuple>

#include "letters.hpp"

namespace palpate::bench {

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

void measure_bounded(const BoundedRunOptions& options, std::span<char* const> command_line) {
  Report report(options, command_line);
  const std::vector<Hypothesis> letters = letter_maps(report.device(), training_recordings());
  const BoundedInputs inputs{report.device(), letters, options.quick};
  constexpr decltype(&measure_bounded_speed) measures[] = {
      measure_bounded_speed, measure_bounded_mode,   measure_bounded_streaming,
      measure_bounded_large, measure_bounded_growth, measure_bounded_search};
  static_assert(std::size(measures) == std::size(bounded_parts));
  Json records = Json::object();
  for (std::size_t i = 0; i < std::size(measures); ++i) {
    if (options.part.empty() || options.part == bounded_parts[i]) {
      records[bounded_parts[i]] = measures[i](inputs, report);
    }
  }
  report.document().update(records);
  report.write();
}

}  // namespace palpate::bench
