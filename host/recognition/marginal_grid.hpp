#pragma once

#include "palpate/lattice.hpp"

namespace palpate {

/// The lattice, or where it is finer than a picture shows a coarser grid of the same poses: at most
/// 400 bins along x and along y and 360 along theta. Bins along x and y are a whole number of the
/// lattice's wide, so that a picture of them shows no stripes; the last of them may reach beyond
/// the region.
PoseLattice marginal_grid(const PoseLattice& lattice);

}  // namespace palpate
