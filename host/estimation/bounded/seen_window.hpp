#pragma once

#include "known_elements.hpp"
#include "palpate/occupancy_grid.hpp"
#include "tile_levels.hpp"

namespace palpate {

/// Tiles [first, end) along each axis.
struct TileWindow {
  int x_first = 0;
  int x_end = 0;
  int y_first = 0;
  int y_end = 0;

  bool holds(int x, int y) const { return x >= x_first && x < x_end && y >= y_first && y < y_end; }
};

/// The tiles in which an element may see something else than the prior, at one theta; none without
/// elements. In all others every bin has the same likelihood.
/// @param turn cosine and sine of theta
TileWindow seen_window(const KnownElements& elements, const glm::dvec2& turn,
                       const OccupancyGrid& map, const TileLevel& level);

}  // namespace palpate
