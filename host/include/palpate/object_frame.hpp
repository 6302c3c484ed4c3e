#pragma once

#include "palpate/api.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Whether the object frame's origin lies on the map's cells.
PALPATE_API bool holds_origin(const OccupancyGrid& map);

/// Puts the object frame's origin on the cell nearest to the centroid of the occupied cells (log
/// odds > 0), with the axes as they were, so that poses tell where the object itself is. The cells
/// stay as they are. A map without an occupied cell keeps its frame.
PALPATE_API void centre_frame(OccupancyGrid& map);

/// Returns T_object_robot in the map's object frame, from one in the frame in which the object was
/// learned; they differ where centre_frame() was called.
PALPATE_API Pose in_centred_frame(const OccupancyGrid& map, const Pose& T_object_robot);

}  // namespace palpate
