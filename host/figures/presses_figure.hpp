#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A press as it lies on a map.
struct DrawnPress {
  std::string caption;
  std::vector<glm::dvec2> contacts_mm;  ///< centres of its elements In Contact, in the object frame
  double theta_rad = 0.0;               ///< by which its elements are turned
  double element_mm = 1.8;              ///< edge at which an element is drawn
};

/// A map and the presses that it was built from; without a map, presses by themselves.
struct DrawnPresses {
  std::string title;
  std::optional<OccupancyGrid> map = {};
  std::vector<DrawnPress> presses;
};

/// Draws each map alone and then, at the same scale and place, under each of its presses, whose
/// elements In Contact are squares: a press lies well where its squares cover what is red. Returns
/// the bytes of a PNG file; the same groups give the same bytes.
/// @throws Error on an empty list, a map without cells, or lack of memory
std::string draw_presses(std::span<const DrawnPresses> groups);

}  // namespace palpate
