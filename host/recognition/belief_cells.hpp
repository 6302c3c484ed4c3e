#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "recognition/belief_modes.hpp"

namespace palpate {

/// x, y and theta.
std::array<const Axis*, 3> axes_of(const PoseLattice& lattice);

/// Indices of a bin along x, y and theta.
using AxisIndices = std::array<int, 3>;
AxisIndices indices_of(const PoseLattice& lattice, std::int64_t bin);

/// (x_mm, y_mm, theta_rad) of a lattice.
using LatticePlace = std::array<double, 3>;
/// A refined pose on the lattice, with the turn of theta that is nearest to the region's middle.
LatticePlace place_of(const RefinedPose& refined, const PoseLattice& lattice);
/// Variances of that place.
LatticePlace variances_of(const RefinedPose& refined, const PoseLattice& lattice);

/// The peaks of an object's belief.
struct BeliefPeaks {
  static constexpr int outside = -2;  ///< in the place of a peak: of none

  std::size_t count = 0;
  std::vector<int> of_bin;  ///< [bin] its peak, below `count`, or `outside`
};
/// Gathers the belief in cells of some bins each, about a millimetre wide by how far they move the
/// object. Gives every cell its peak, from the densest cell down: that of its densest neighbour.
/// Joins peaks with a higher one where they hardly stand above the saddle between them; leaves
/// cells far below their peak out. See find_modes().
/// @param bins,at the bins and their indices
BeliefPeaks peaks_of(const BinnedObject& of, std::span<const BinShare> bins,
                     std::span<const AxisIndices> at);

}  // namespace palpate
