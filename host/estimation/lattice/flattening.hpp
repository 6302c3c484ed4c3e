#pragma once

#include <span>

#include <glm/vec3.hpp>

namespace palpate {

/// A bin of a window of the belief.
struct DisplacedBin {
  glm::dvec3 moved_mm{0.0};  ///< how far it moves the object: shift and turn, in mm
  double log_likelihood = 0.0;
};

/// The root of the belief in at least one bin, no less than `least`, under which its bins spread by
/// a third of what they would if all weighed the same, in the root mean square about their mean.
/// Many touches leave nearly all of a belief in one bin of a coarse lattice, and a fixed root of it
/// no better.
double flattening_root(std::span<const DisplacedBin> bins, double least);

}  // namespace palpate
