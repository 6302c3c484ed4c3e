#pragma once

#include <filesystem>
#include <functional>
#include <span>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Reads a "palpate.map" HDF5 file, holding a few MB of it at a time, and checks all of it.
/// @param head is given the map without cells
/// @param cells are given the log odds, row by row, in pieces
/// @throws Error as read_map() does
void scan_map(const std::filesystem::path& path,
              const std::function<void(const OccupancyGrid&)>& head,
              const std::function<void(std::span<const float>)>& cells);

}  // namespace palpate
