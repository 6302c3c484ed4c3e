#pragma once

#include "palpate/lattice.hpp"

namespace palpate {

/// The lattice with every few bins along x and y where they are much finer than a pose's fit needs:
/// steps of 0.1 mm at most, and at least three bins of an axis that has as many. Its region lies
/// within the lattice's, and its centres are centres of the lattice.
PoseLattice thinned(PoseLattice lattice);

}  // namespace palpate
