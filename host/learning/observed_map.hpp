#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The map of touches at known poses, as MapBuilder builds it, with what learning needs besides:
///   observations: number of touches of which a known element lies within one element spacing of
///     the cell's centre. The spacing is the largest distance of an element of the touch's array to
///     its nearest neighbour; twice the sensor model's spread for an array of one element.
///   mean_level: mean over these touches of the pressure at the cell. A touch's pressure at a cell
///     is the mean over its living elements, weighted by a Gaussian of their distance whose
///     standard deviation is the sensor model's spread, at least a quarter of the spacing; it
///     leaves out elements beyond four deviations and the spacing. A pressure below 0 counts as 0.
/// The object frame is the robot frame of the touches. Computes on the calling thread in float64.
/// @throws Error as MapBuilder does
OccupancyGrid observed_map(std::span<const Touch> touches, const MapOptions& options,
                           const std::string& label);

/// Maps of touches that are divided into parts.
struct ObservedMaps {
  OccupancyGrid all;
  /// [part] the map of the touches of all other parts; without cells where there are none
  std::vector<OccupancyGrid> without;
};
/// observed_map() of all touches and without each part, in hardly more time than of all. Gaussians
/// are cut off where they are for all touches. Takes all host threads.
/// @param part of every touch, counted from 0
/// @throws Error as observed_map() for any of the maps
ObservedMaps observed_maps(std::span<const Touch> touches, std::span<const std::size_t> part,
                           const MapOptions& options, const std::string& label);

}  // namespace palpate
