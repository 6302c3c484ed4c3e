#pragma once

#include <cstdint>

#include "dense_belief.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

/// The body whose displacement measures how far two poses are apart: the map's occupied cells, or
/// the whole grid where none is.
Body displaced_body(const OccupancyGrid& map);

/// Peak and covariance of one object's belief around a bin, as PoseHistogram::refine() has them.
/// @throws Error if the device fails
RefinedPose refine(const DenseBelief& belief, const PoseLattice& lattice, std::size_t object,
                   const Body& body, std::int64_t bin);

}  // namespace palpate
