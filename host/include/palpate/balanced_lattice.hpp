#pragma once

#include <cstdint>
#include <span>

#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Step of a balanced lattice, relative to the finest detail that the maps resolve: the larger of a
/// map's cell and, where the map knows it, its sensor model's spread. docs/refinement.md says why.
inline constexpr double balanced_step = 0.6;

/// Default limit of balanced_lattice() on the bins of all objects together: 0.8 GB.
inline constexpr std::int64_t most_balanced_bins = 100'000'000;

/// A region with bin counts that suit the maps.
struct BalancedLattice {
  PoseLattice lattice;
  double step_mm = 0.0;    ///< largest step along x and y; in theta, largest motion of an object
  bool coarsened = false;  ///< true where the limit allows fewer bins than the maps resolve
};

/// Chooses the bin counts for `region`; ignores the counts it already has. Steps along x and y are
/// at most `balanced_step` of the finest detail. A step in theta moves each object by at most the
/// same length: the root mean square over its occupied cells and over where in the region its pivot
/// may be. An axis of zero extent gets one bin. Where all objects together would have more than
/// `most_bins` bins, the steps of all axes grow by one factor.
/// @throws Error on an empty list, a map that is not sound or a region that is out of range
BalancedLattice balanced_lattice(const PoseLattice& region, std::span<const Hypothesis> hypotheses,
                                 std::int64_t most_bins = most_balanced_bins);

/// The number of bins, of all objects together, that fill half of the device's memory; at most
/// `most_balanced_bins`. A bin takes 8 bytes, or 16 where `still_array` doubles the belief.
std::int64_t most_bins_on(const Device& device, bool still_array);

}  // namespace palpate
