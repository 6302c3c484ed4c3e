#pragma once

#include "estimation/bin_box.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

/// The body whose displacement measures how far two poses are apart: the map's occupied cells, or
/// the whole grid where no cell is occupied.
Body displaced_body(const OccupancyGrid& map);

/// The refined pose near the mode, and its covariance, as PoseHistogram::refine() says.
/// @param log_likelihood of the mode's object
/// @throws Error if there is no such bin or the pose is not finite; what `log_likelihood` throws
RefinedPose refine(const BoxLogLikelihood& log_likelihood, const PoseLattice& lattice,
                   const Body& body, const Mode& mode);

}  // namespace palpate
