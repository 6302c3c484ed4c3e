#pragma once

#include <cstdint>
#include <span>

#include "palpate/api.hpp"
#include "palpate/device.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Step of a balanced lattice, relative to the length that BinWidth names. docs/refinement.md says
/// why.
inline constexpr double balanced_step = 0.6;

/// What bins are to resolve.
enum class BinWidth {
  /// What the refined pose needs: steps of 0.6 times a map's cell, or 1.2 times the spread of its
  /// sensor model where this is more. Of a map that does not know the spread, 1.2 times the cell.
  automatic,
  /// What the mode needs, too: steps of 0.6 times the larger of a map's cell and spread.
  fine,
};

/// Default limit of balanced_lattice() on the bins of all objects together: 0.8 GB.
inline constexpr std::int64_t most_balanced_bins = 100'000'000;

/// A region with bin counts that suit the maps.
struct BalancedLattice {
  PoseLattice lattice;
  double step_mm = 0.0;    ///< largest step along x and y; in theta, largest motion of an object
  bool coarsened = false;  ///< true where the limit allows fewer bins than the maps resolve
};

/// Chooses the bin counts for `region`; ignores the counts it already has. Steps along x and y are
/// at most the least that any map asks for (BinWidth). A step in theta moves each object by at most
/// the same length: the root mean square over its occupied cells and over where in the region its
/// pivot may be. Where touches are uncertain, what is believed is smoother: steps by `automatic`
/// are up to half a standard deviation of touches, or five quarters of what an object slips by,
/// but at most 2.5 times as wide. An axis of zero extent gets one bin. Where all objects together
/// would have more than `most_bins` bins, the steps of all axes grow by one factor.
/// @throws Error on an empty list, a map that is not sound, and a region or sd out of range
PALPATE_API BalancedLattice balanced_lattice(const PoseLattice& region,
                                             std::span<const Hypothesis> hypotheses,
                                             std::int64_t most_bins = most_balanced_bins,
                                             BinWidth width = BinWidth::automatic,
                                             const DisplacementSd& touch_sd = {},
                                             const DisplacementSd& slip_sd = {});

/// The poses of an object that an array touches, about the array's centre.
struct TouchRegion {
  PoseLattice lattice;  ///< one bin along each axis; pivot at the robot frame's origin
  /// Area over the area for objects of these sizes that all lie about one origin; 1 at least.
  double excess = 1.0;
};

/// The region of a lattice whose pivot is the array's centre at a touch. x and y, the pivot's
/// place in the object frame, cover the box around every map's cells with log odds above 0, grown
/// by the array's reach at any angle; a map without such a cell counts with all of its cells. Theta
/// covers the circle. The pose of a touch that meets an object lies in the region; the pose of a
/// touch beside all objects need not.
/// @param reach_mm largest distance of an element from the array's centre; see array_reach_mm()
/// @throws Error on an empty list, a map that is not sound, or a reach that is negative or out of
/// range
PALPATE_API TouchRegion touch_region(std::span<const Hypothesis> hypotheses, double reach_mm);

/// The number of bins, of all objects together, that fill half of the device's memory; at most
/// `most_balanced_bins`. A bin takes 8 bytes.
PALPATE_API std::int64_t most_bins_on(const Device& device);

}  // namespace palpate
