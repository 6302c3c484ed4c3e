#pragma once

#include <span>
#include <vector>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "estimation/bin_box.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

/// Indices of a bin along each axis.
struct BinIndex {
  int x = 0;
  int y = 0;
  int theta = 0;

  bool operator==(const BinIndex&) const = default;
};

/// How far a body moves when its pose changes from a given (x_mm, y_mm, theta_rad) of the lattice:
/// the shift of its centroid along x and y, and its turn, all in mm. The turn counts as the root
/// mean square displacement of the body about its centroid.
class BodyMotion {
 public:
  BodyMotion(const Body& body, const glm::dvec3& place);

  /// The motion by a change of (x_mm, y_mm, theta_rad).
  glm::dvec3 by(const glm::dvec3& change) const;
  /// The change of (x_mm, y_mm, theta_rad) that makes this motion.
  glm::dvec3 change_for(const glm::dvec3& moved_mm) const;

 private:
  /// A turn about the pivot moves the body's centroid, as seen from the object, along an arc.
  glm::dvec2 swing_mm(double turn_rad) const;

  glm::dvec2 lever_mm_;  ///< from the pivot to the centroid
  double spin_mm_;       ///< root mean square distance of the body from its centroid
};

/// The bins around a centre bin that move the body by at most a radius, and the centre bin's
/// neighbours.
struct BodyWindow {
  struct Bin {
    glm::dvec3 offset{0.0};    ///< from the centre bin, in (x_mm, y_mm, theta_rad)
    glm::dvec3 moved_mm{0.0};  ///< how far the body moves: BodyMotion::by(offset)
    double log_likelihood = 0.0;
    bool within_radius = false;  ///< otherwise the bin is only a neighbour of the centre bin
  };

  glm::dvec3 centre{0.0};  ///< of the centre bin, in (x_mm, y_mm, theta_rad)
  std::vector<Bin> bins;
  double largest = 0.0;  ///< log-likelihood of the best of the bins
};

/// @param object of the bins that `log_likelihood` is asked for
BodyWindow body_window(const BoxLogLikelihood& log_likelihood, const PoseLattice& lattice,
                       int object, const Body& body, const BinIndex& centre, double radius_mm);

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
