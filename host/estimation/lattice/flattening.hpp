#pragma once

#include <span>

#include <glm/vec3.hpp>

namespace palpate {

/// A bin of a window.
struct DisplacedBin {
  glm::dvec3 moved_mm{0.0};  ///< how far the bin moves the object: shift and turn, in mm
  double log_likelihood = 0.0;
};

/// The n, at least `least`, for which the bins under weights belief^(1/n) spread by a third of
/// their spread under equal weights. The spread is the root mean square distance from the weighted
/// mean. Returns `least` where the bins spread as far already. docs/refinement.md says why.
/// @param bins at least one
double flattening_root(std::span<const DisplacedBin> bins, double least);

}  // namespace palpate
