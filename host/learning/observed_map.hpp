#pragma once

#include <span>
#include <string>

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

}  // namespace palpate
