#pragma once

#include <vector>

#include "palpate/palpate.hpp"

namespace palpate {

/// Maps of A, E and I from simulated touches.
std::vector<Hypothesis> letter_maps(Device& device);

/// `touches` simulated touches of a letter E that lies elsewhere, each by a differing number of
/// known elements.
Recording unknown_letter(int touches);

/// 10 x 10 x 16 bins: few, for tests that make many filters.
PoseLattice small_lattice();

}  // namespace palpate
