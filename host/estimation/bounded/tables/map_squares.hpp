#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A map with one node of the prior around it, divided into equal rectangles, its squares. Knows
/// the log odds, bilinear between the nodes, at every place where they may be extreme in a square:
/// at the corners of the parts that the areas between neighbouring nodes cut it into.
struct MapSquares {
  std::vector<int> first_x;      ///< [nx + 1] column of the places on a square's lower border
  std::vector<int> first_y;      ///< [ny + 1] row of these
  std::vector<double> log_odds;  ///< [row, column] in nats

  int nx() const { return static_cast<int>(first_x.size()) - 1; }
  int ny() const { return static_cast<int>(first_y.size()) - 1; }
  std::size_t columns() const { return static_cast<std::size_t>(first_x.back()) + 1; }
};

/// Squares of which `parts` divide the distance of two nodes.
MapSquares squares_of_cells(const OccupancyGrid& map, double prior_log_odds, int parts);

/// Squares of any size. The last of a row or column may reach beyond the map.
MapSquares squares_of_size(const OccupancyGrid& map, double prior_log_odds,
                           const glm::dvec2& square_mm);

}  // namespace palpate
