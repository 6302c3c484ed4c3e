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

/// For every object and every fold, see folds_of(), the map of the object's presses of the other
/// folds, in the object frame. Takes all host threads.
/// @param presses at known poses, of one touch each
/// @throws Error, naming the object, as observed_map() does
std::vector<TrainingMap> maps_without_folds(const std::vector<Press>& presses,
                                            const MapOptions& options, std::size_t folds);

/// For every object the map of all its presses, in the object frame. Takes all host threads.
/// @param presses at known poses, of one touch each
/// @throws Error, naming the object, as observed_map() does
std::vector<TrainingMap> maps_of_objects(const std::vector<Press>& presses,
                                         const MapOptions& options);

}  // namespace palpate
