#pragma once

#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/tables/tile_levels.hpp"
#include "model/bounding_box.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// The box around the elements, from the pivot, at every theta.
/// @param turns [theta] its cosine and sine
std::vector<BoundingBox> reaches_of(const KnownElements& elements,
                                    std::span<const glm::dvec2> turns);

/// The tiles in which an element may see something else than the prior, at one theta; none without
/// elements. In all others every bin has the same likelihood.
/// @param reach of the elements at this theta
TileRange seen_tiles(const BoundingBox& reach, const OccupancyGrid& map, const TileLevel& level);

}  // namespace palpate
