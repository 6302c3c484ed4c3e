#pragma once

#include <filesystem>
#include <functional>
#include <span>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Reads and checks a "palpate.map" HDF5 file, holding a few MB of it at a time.
/// @param head called with the map without cells
/// @param cells called with the log odds in row-major order, in pieces
/// @throws Error as read_map() does
void scan_map(const std::filesystem::path& path,
              const std::function<void(const OccupancyGrid&)>& head,
              const std::function<void(std::span<const float>)>& cells);

}  // namespace palpate
