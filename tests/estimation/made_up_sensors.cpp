#include "made_up_sensors.hpp"

#include <cmath>
#include <utility>

#include "palpate/learned_sensor.hpp"
#include "support/synthetic.hpp"

namespace palpate {

namespace {

constexpr double node_step = 0.05;

LikelihoodTable empty_table(std::vector<double> level_edges) {
  constexpr double end = 13.0;
  return {.first_log_odds = -end,
          .last_log_odds = end,
          .nodes = static_cast<std::size_t>(std::lround(2.0 * end / node_step)) + 1,
          .level_edges = std::move(level_edges),
          .log_likelihood = {}};
}

/// A map of which patches were sensed, with counts and mean levels.
OccupancyGrid sensed_in_part(const char* label, int nx, int ny, double cell_mm,
                             std::uint64_t seed) {
  OccupancyGrid map = random_map(nx, ny, cell_mm, 12.0, seed);
  map.label = label;
  Uniform random(seed + 1);
  const glm::dvec2 middle(random(0.0, nx), random(0.0, ny));
  const double radius = random(2.0, 0.7 * nx);
  for (std::size_t cell = 0; cell < map.log_odds.size(); ++cell) {
    const auto column = static_cast<double>(cell % nx);
    const auto row = static_cast<double>(cell / nx);
    const bool sensed =
        std::hypot(column - middle.x, row - middle.y) < radius || random(0.0, 1.0) < 0.02;
    map.observations.push_back(sensed ? 2.0F : 0.0F);
    map.mean_level.push_back(sensed ? static_cast<float>(random(0.0, 25.0)) : 0.0F);
    if (!sensed) {
      map.log_odds[cell] = static_cast<float>(map.prior_log_odds());
    }
  }
  return map;
}

/// Numbers of so many levels that jump by some nats from node to node, as those of nodes with few
/// counts do.
std::vector<double> jagged(std::size_t levels, Uniform& random) {
  std::vector<double> numbers(levels * ReadingLayer::nodes);
  for (double& number : numbers) {
    number = random(-6.0, 0.0);
  }
  return numbers;
}

}  // namespace

ContactModel random_table(std::size_t objects) {
  LikelihoodTable table = empty_table({8.0, 11.0, 15.0});
  Uniform random(71);
  for (std::size_t row = 0; row < objects * table.levels(); ++row) {
    // As smooth as counts of readings are.
    const double slope = random(-0.2, 0.2);
    for (std::size_t i = 0; i < table.nodes; ++i) {
      table.log_likelihood.push_back(-3.0 + slope * node_step * static_cast<double>(i) +
                                     random(-0.1, 0.1));
    }
  }
  return {.table = std::move(table)};
}

LearnedScene learned_scene(MapLayer of, std::uint64_t seed) {
  Uniform random(seed);
  LearnedSensor sensor;
  sensor.table = LearnedTable{
      .layer = {.of = of, .near_mm = 1.5, .far_mm = 4.0, .unit_level = 0.5, .full_level = 20.0},
      .level_edges = {9.0, 14.0}};
  sensor.table->shared = jagged(sensor.table->levels(), random);
  sensor.table->objects["pen"] = jagged(sensor.table->levels(), random);
  LearnedScene scene{.objects = {{sensed_in_part("cup", 31, 27, 0.5, seed + 10), 1.0},
                                 {sensed_in_part("pen", 23, 37, 0.4, seed + 20), 3.0},
                                 {sensed_in_part("box", 12, 15, 1.0, seed + 30), 0.5}},
                     .contact = {}};
  scene.objects[1].map.mirror = true;
  add_mirror_images(scene.objects);
  apply(sensor, scene.objects, scene.contact);
  return scene;
}

}  // namespace palpate
