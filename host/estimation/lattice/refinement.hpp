#pragma once

#include <span>

#include "estimation/bin_box.hpp"
#include "estimation/lattice/body_window.hpp"
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

/// The lattice with every few bins along x and y where they are much finer than a pose's fit needs:
/// steps of 0.1 mm at most, and at least three bins of an axis that has as many. Its region lies
/// within the lattice's, and its centres are centres of the lattice.
PoseLattice thinned(PoseLattice lattice);

/// The n, at least `least`, for which the bins under weights belief^(1/n) spread by a third of
/// their spread under equal weights. The spread is the root mean square distance from the weighted
/// mean. Returns `least` where the bins spread as far already. docs/refinement.md says why.
/// @param bins at least one
double flattening_root(std::span<const BodyWindow::Bin> bins, double least);

}  // namespace palpate
