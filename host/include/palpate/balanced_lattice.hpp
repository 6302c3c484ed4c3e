#pragma once

#include <cstdint>
#include <span>

#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Step of balanced bins, as a part of what a map resolves: of the larger of its cell and, where
/// the map knows it, the spread of its sensor model. The map changes little over less, and the
/// refined pose lies between the bins anyhow. Every halving costs eight times the bins.
inline constexpr double balanced_step = 0.6;

/// Bins of all objects together that balanced_lattice() does not exceed by itself: 0.8 GB, and on
/// two CPU cores some 2.5 s for a touch of 36 elements.
inline constexpr std::int64_t most_balanced_bins = 100'000'000;

/// Counts of bins chosen for a region.
struct BalancedLattice {
  PoseLattice lattice;     ///< the region with the counts
  double step_mm = 0.0;    ///< largest step along x and y, and of the objects at a step in theta
  bool coarsened = false;  ///< coarser than the maps are worth, for there would be too many bins
};

/// Counts for the region of a lattice, whose own are not read: x and y in steps of at most
/// `balanced_step` of what the finest map resolves, theta in steps that turn each object by as
/// much, root mean square over its occupied cells and over where in the region the pivot may be in
/// it. The letters of Sec. IV, over 20 mm and the full circle, get some 67 x 67 x 280 with cells of
/// 0.5 mm, and no more with smaller ones under the spread of 0.5 mm that a point spread of 1 mm
/// has. An axis of zero extent costs one bin. Where that makes more than `most_bins` of all objects
/// together, all axes are made coarser alike.
/// @throws Error on an empty list, a map that is not sound or a region that is out of range
BalancedLattice balanced_lattice(const PoseLattice& region, std::span<const Hypothesis> hypotheses,
                                 std::int64_t most_bins = most_balanced_bins);

/// Bins of all objects together that fill half of the device's memory, at 8 bytes each, or, where
/// `still_array` makes it two of them, 16; at most `most_balanced_bins`.
std::int64_t most_bins_on(const Device& device, bool still_array);

}  // namespace palpate
