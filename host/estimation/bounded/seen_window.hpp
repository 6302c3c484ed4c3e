#pragma once

#include "known_elements.hpp"
#include "palpate/occupancy_grid.hpp"
#include "tile_levels.hpp"

namespace palpate {

/// The tiles in which an element may see something else than the prior, at one theta; none without
/// elements. In all others every bin has the same likelihood.
/// @param turn cosine and sine of theta
TileWindow seen_window(const KnownElements& elements, const glm::dvec2& turn,
                       const OccupancyGrid& map, const TileLevel& level);

}  // namespace palpate
