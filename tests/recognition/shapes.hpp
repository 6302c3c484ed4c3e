#pragma once

#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/touch.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// Maps of the letter L and of a disc of full symmetry.
std::vector<Hypothesis> shapes();

/// A histogram, particles and bounds: over a lattice on which few touches tell the shapes apart,
/// and as many particles as it has bins.
std::vector<FilterOptions> every_filter();

/// Six touches of the letter at a pose within the lattice, with the truth.
Recording touched_letter(std::uint64_t seed);
/// Six touches of the disc at a pose within the lattice, with the truth.
Recording touched_disc(std::uint64_t seed);

}  // namespace palpate
