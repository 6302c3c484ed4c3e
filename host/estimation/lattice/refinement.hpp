#pragma once

#include <cstdint>

#include "bin_window.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

/// The body whose displacement measures how far two poses are apart: the map's occupied cells, or
/// the whole grid where no cell is occupied.
Body displaced_body(const OccupancyGrid& map);

/// The pose between the bins near `bin`, and its covariance, as PoseHistogram::refine() says.
/// Throws what `log_likelihood` throws.
RefinedPose refine(const WindowLogLikelihood& log_likelihood, const PoseLattice& lattice,
                   const Body& body, std::int64_t bin);

}  // namespace palpate
