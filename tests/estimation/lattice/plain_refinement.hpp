#pragma once

#include <cstdint>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// PoseHistogram::refine(), looking at every bin of the lattice for those of the window.
RefinedPose plain_refinement(const std::vector<double>& logs, const PoseLattice& lattice,
                             const OccupancyGrid& map, std::int64_t bin);

}  // namespace palpate
