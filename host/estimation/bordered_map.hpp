#pragma once

#include <vector>

#include "interface.h"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// The map's log odds as kernels read them, with shaders::MAP_BORDER rows and columns of the prior
/// on every side, so that a clamped index finds the prior.
std::vector<float> with_border(const OccupancyGrid& map, double prior);

/// The same nodes, each with the three above and to its right: a kernel interpolates from one.
/// Beyond the border lies the prior.
std::vector<shaders::Corners> corners_with_border(const OccupancyGrid& map, double prior);

/// The lattice's x, then its y, in cells of the map with its border, [nx + ny].
std::vector<shaders::Split> axes_in_cells(const OccupancyGrid& map, const PoseLattice& lattice);

}  // namespace palpate
