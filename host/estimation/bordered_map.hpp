#pragma once

#include <vector>

#include "interface.h"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// The map's log odds as kernels read them, with shaders::MAP_BORDER rows and columns of the prior
/// on every side, so that a clamped index finds the prior.
std::vector<float> with_border(const OccupancyGrid& map, double prior);

/// The same nodes, each with the three above and to its right: a kernel interpolates from one.
/// Beyond the border lies the prior.
std::vector<shaders::Corners> corners_with_border(const OccupancyGrid& map, double prior);

}  // namespace palpate
