#pragma once

#include "estimation/bounded/known_elements.hpp"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// What bounds the rounding of log odds that are interpolated on a map under a lattice's bins.
struct MapExtent {
  // Over all nodes of the map and the prior beyond.
  double largest = 0.0;   ///< magnitude
  double range = 0.0;     ///< largest less smallest
  double steepest = 0.0;  ///< difference between neighbours along an axis

  double cell_mm = 0.0;
  double lattice_cells = 0.0;  ///< no bin nor node is farther from the frames' origins
  double reach_cells = 0.0;    ///< elements farther from the pivot are off the map at every bin

  /// Bound, in cells along an axis, of the float64 rounding of an element's place at a bin.
  double place_error(const KnownElements& elements) const;
  /// Bound of the change of log odds where a place is wrong by so many cells along both axes.
  double change(double place_cells) const;
};

MapExtent extent_of(const OccupancyGrid& map, double prior_log_odds, const PoseLattice& lattice);

}  // namespace palpate
