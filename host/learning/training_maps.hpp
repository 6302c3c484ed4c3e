#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "learning/press.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A map that presses are compared with, and the presses that it was built from.
struct TrainingMap {
  OccupancyGrid map;
  std::vector<std::size_t> presses = {};  ///< indices, ascending; none of a map from elsewhere

  bool holds(std::size_t press) const { return std::ranges::binary_search(presses, press); }
};

/// The map that each press makes alone, see observed_map(), in the press's robot frame. Takes all
/// host threads.
/// @throws Error, naming the press, as observed_map() does
std::vector<TrainingMap> maps_of_presses(const std::vector<Press>& presses,
                                         const MapOptions& options);

/// Maps of presses at known poses, in the object frame.
struct MapsByFolds {
  std::vector<TrainingMap> of_objects;  ///< of all presses of every object
  /// For every object and every fold, see folds_of(), of the object's presses of the other folds.
  std::vector<TrainingMap> without_folds;
};
/// Takes all host threads.
/// @param presses at known poses, of one touch each
/// @throws Error, naming the object, as observed_map() does
MapsByFolds maps_by_folds(const std::vector<Press>& presses, const MapOptions& options,
                          std::size_t folds);

}  // namespace palpate
