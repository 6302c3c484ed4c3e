#include "palpate/object_frame.hpp"

#include <algorithm>

#include <glm/common.hpp>
#include <glm/vector_relational.hpp>

#include "palpate/pose_error.hpp"

namespace palpate {

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

}  // namespace palpate
