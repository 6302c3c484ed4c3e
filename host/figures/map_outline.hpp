#pragma once

#include <vector>

#include <glm/vec2.hpp>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Closed outlines of what a map holds for occupied, in the object frame, mm: where its log odds,
/// linear between the centres of cells, are 0. Counter-clockwise about what is occupied, clockwise
/// about holes. None where no cell has log odds above 0.
std::vector<std::vector<glm::dvec2>> outlines_of(const OccupancyGrid& map);

}  // namespace palpate
