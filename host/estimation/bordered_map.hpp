#pragma once

#include <vector>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// The map's log odds as kernels read them, with shaders::MAP_BORDER rows and columns of the prior
/// on every side, so that a clamped index finds the prior.
std::vector<float> with_border(const OccupancyGrid& map, double prior);

}  // namespace palpate
