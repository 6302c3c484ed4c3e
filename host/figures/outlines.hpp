#pragma once

#include <array>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// The area that one touch covers, in mm, in the frame of its element centres.
struct Footprint {
  std::vector<std::array<glm::dvec2, 4>> elements;  ///< one square each
  std::vector<glm::dvec2> outline;  ///< convex hull of the squares, counter-clockwise
};

/// Returns squares of edge `element_mm` around the centres, aligned with the smallest rectangle
/// that holds all centres: for a rectangular array, with the array.
Footprint footprint(std::span<const glm::dvec2> centres_mm, double element_mm);

/// Closed outlines of what a map holds for occupied, in the object frame, mm: where its log odds,
/// linear between the centres of cells, are 0. Counter-clockwise about what is occupied, clockwise
/// about holes. None where no cell has log odds above 0.
std::vector<std::vector<glm::dvec2>> outlines_of(const OccupancyGrid& map);

}  // namespace palpate
