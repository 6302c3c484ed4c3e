#include "palpate/occupancy_grid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "model/bounding_box.hpp"
#include "model/refuse.hpp"
#include "palpate/estimate.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

namespace {

bool is_length(double mm) { return mm >= least_length_mm && mm <= most_length_mm; }

bool is_near(const glm::dvec2& p_mm) {
  return std::abs(p_mm.x) <= farthest_mm && std::abs(p_mm.y) <= farthest_mm;
}

/// Why numbers that go with the cells are not sound.
std::optional<std::string> fault_of_layer(const OccupancyGrid& map, const char* name,
                                          std::span<const float> numbers) {
  const auto nx = static_cast<std::size_t>(map.nx);
  const auto ny = static_cast<std::size_t>(map.ny);
  if (numbers.size() != nx * ny) {
    return fmt::format("'{}' has {} numbers for {} x {} cells; store one for each, or none", name,
                       numbers.size(), ny, nx);
  }
  const auto wrong = std::find_if_not(numbers.begin(), numbers.end(),
                                      [](float x) { return x >= 0.0F && std::isfinite(x); });
  if (wrong == numbers.end()) {
    return {};
  }
  const auto k = static_cast<std::size_t>(wrong - numbers.begin());
  return fmt::format("'{}'[{}, {}] = {}; give finite numbers from 0", name, k / nx, k % nx, *wrong);
}

}  // namespace

double log_odds_from_probability(double p) { return std::log(p) - std::log1p(-p); }

double probability_from_log_odds(double l) {
  const double z = std::exp(-std::abs(l));
  return (l >= 0 ? 1.0 : z) / (1.0 + z);
}

std::optional<std::string> fault_of(const OccupancyGrid& map) {
  if (auto fault = fault_without_cells(map)) {
    return fault;
  }
  if (map.log_odds.size() != static_cast<std::size_t>(map.nx) * static_cast<std::size_t>(map.ny)) {
    return fmt::format("{} x {} cells but {} log odds; make them agree", map.nx, map.ny,
                       map.log_odds.size());
  }
  for (const auto& [name, numbers] :
       {std::pair{"observations", &map.observations}, std::pair{"mean_level", &map.mean_level}}) {
    if (!numbers->empty()) {
      if (auto fault = fault_of_layer(map, name, *numbers)) {
        return fault;
      }
    }
  }
  return fault_of_cells(map, 0, map.log_odds);
}

std::optional<std::string> fault_without_cells(const OccupancyGrid& map) {
  if (map.nx < 1 || map.ny < 1 || std::int64_t{map.nx} * map.ny > most_cells) {
    return fmt::format("{} x {} cells; use at least one and at most {}", map.nx, map.ny,
                       most_cells);
  }
  if (map.label == none_label) {
    return fmt::format("'label' = '{}' is kept for objects that were never learned; choose another",
                       map.label);
  }
  if (!is_length(map.cell_mm)) {
    return fmt::format("'cell_mm' = {}; give {:g} to {:g} mm", map.cell_mm, least_length_mm,
                       most_length_mm);
  }
  if (!is_near(map.origin_mm) || !is_near(map.centre_mm(map.nx - 1, map.ny - 1))) {
    return fmt::format(
        "'origin_mm' = [{}, {}] of {} x {} cells; keep the map within {:g} mm of the "
        "object frame's origin",
        map.origin_mm.x, map.origin_mm.y, map.nx, map.ny, farthest_mm);
  }
  const Pose& learned = map.T_learned_robot_object;
  if (!is_near(learned.translation_mm) || !std::isfinite(learned.theta_rad)) {
    return fmt::format("'T_learned_robot_object' = [{}, {}, {}]; give x and y in mm and radians",
                       learned.translation_mm.x, learned.translation_mm.y, learned.theta_rad);
  }
  if (!is_near(map.centred_mm)) {
    return fmt::format("'centred_mm' = [{}, {}]; give x and y in mm", map.centred_mm.x,
                       map.centred_mm.y);
  }
  if (!(map.prior > 0.0 && map.prior < 1.0)) {
    return fmt::format("'prior' = {}; make it a probability between 0 and 1", map.prior);
  }
  for (const auto& [field, symmetry] :
       {std::pair{"symmetry", map.symmetry},
        std::pair{"suggested_symmetry", map.suggested_symmetry.value_or(1)}}) {
    if (symmetry < 0) {
      return fmt::format("'{}' = {}; make it 1, n for an n-fold symmetry or 0 for full symmetry",
                         field, symmetry);
    }
  }
  // A map is wider than its spread, as it reaches several spreads beyond what was touched.
  const double side_mm = map.cell_mm * std::max(map.nx, map.ny);
  if (map.spread_mm && !(is_length(*map.spread_mm) && *map.spread_mm <= side_mm)) {
    return fmt::format(
        "'spread_mm' = {}; give {:g} mm to the grid's longer side of {:g} mm, or "
        "leave it out",
        *map.spread_mm, least_length_mm, side_mm);
  }
  return {};
}

std::optional<std::string> fault_of_cells(const OccupancyGrid& map, std::size_t first,
                                          std::span<const float> log_odds) {
  const auto wrong = std::find_if_not(log_odds.begin(), log_odds.end(), [](float l) {
    return std::abs(l) <= static_cast<float>(most_log_odds);
  });
  if (wrong != log_odds.end()) {
    const std::size_t k = first + static_cast<std::size_t>(wrong - log_odds.begin());
    const auto nx = static_cast<std::size_t>(map.nx);
    return fmt::format("'log_odds'[{}, {}] = {} in float32; give finite numbers within +-{:g}",
                       k / nx, k % nx, *wrong, most_log_odds);
  }
  return {};
}

OccupancyGrid mirror_image(const OccupancyGrid& map) {
  require_sound_map(map);
  OccupancyGrid image = map;
  image.source.reset();  // its touches are of the side that was learned
  image.origin_mm.x = 0.0 - map.centre_mm(map.nx - 1, 0).x;
  for (std::vector<float>* cells : {&image.log_odds, &image.observations, &image.mean_level}) {
    for (auto row = cells->begin(); row != cells->end(); row += map.nx) {
      std::reverse(row, row + map.nx);
    }
  }
  return image;
}

void add_mirror_images(std::vector<Hypothesis>& hypotheses) {
  std::vector<Hypothesis> all;
  for (Hypothesis& hypothesis : hypotheses) {
    const bool mirror = hypothesis.map.mirror;
    all.push_back(std::move(hypothesis));
    if (mirror) {
      all.back().weight /= 2.0;
      Hypothesis image = all.back();
      image.map = mirror_image(image.map);
      if (image.layer) {
        image.layer = mirror_image(*image.layer);
      }
      image.mirrored = true;
      all.push_back(std::move(image));
    }
  }
  hypotheses = std::move(all);
}

bool holds_origin(const OccupancyGrid& map) {
  const glm::dvec2 cell = -map.origin_mm / map.cell_mm;  // column and row, with fractions
  return glm::all(glm::greaterThanEqual(cell, glm::dvec2(-0.5))) &&
         glm::all(glm::lessThanEqual(cell, glm::dvec2(map.nx, map.ny) - 0.5));
}

void centre_frame(OccupancyGrid& map) {
  if (std::ranges::none_of(map.log_odds, [](float l) { return l > 0.0F; })) {
    return;
  }
  // Origins are whole multiples of the cell; the difference of two must be one again.
  const glm::dvec2 middle = glm::round(body_of(map).centroid_mm / map.cell_mm);
  map.origin_mm = map.cell_mm * (glm::round(map.origin_mm / map.cell_mm) - middle);
  map.T_learned_robot_object = map.T_learned_robot_object * Pose{map.cell_mm * middle, 0.0};
  map.centred_mm += map.cell_mm * middle;
}

Pose in_centred_frame(const OccupancyGrid& map, const Pose& T_object_robot) {
  return inverse(Pose{map.centred_mm, 0.0}) * T_object_robot;
}

BoundingBox occupied_box(const OccupancyGrid& map) {
  BoundingBox box;
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (map.at(i, j) > 0.0F) {
        box.take_in(map.centre_mm(i, j));
      }
    }
  }
  if (box.empty()) {
    box.take_in(map.centre_mm(0, 0));
    box.take_in(map.centre_mm(map.nx - 1, map.ny - 1));
  }
  box.lower -= map.cell_mm / 2.0;
  box.upper += map.cell_mm / 2.0;
  return box;
}

}  // namespace palpate
