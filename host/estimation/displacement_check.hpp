#pragma once

#include "palpate/displacement.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The largest standard deviations that a lattice takes: for mm the smaller extent of x and y, for
/// rad the extent of theta. An axis of one bin limits nothing; infinity where no axis does.
DisplacementSd widest_displacement(const PoseLattice& lattice);

/// Throws Error, "<name> mm = ..." or "<name> rad = ...", unless both standard deviations are
/// finite, at least 0 and within widest_displacement().
void validate_displacement(const DisplacementSd& sd, const PoseLattice& lattice, const char* name);

}  // namespace palpate
