#pragma once

#include <filesystem>
#include <vector>

namespace palpate {

/// The maps in a folder: its *.map.h5 and what else is a map among its *.h5, in order.
/// @throws Error where the folder cannot be read
std::vector<std::filesystem::path> maps_in(const std::filesystem::path& folder);

/// The map files that an argument of --maps stands for: itself or, of a folder, maps_in().
/// @throws Error where a folder has none
std::vector<std::filesystem::path> map_files(const std::filesystem::path& argument);

}  // namespace palpate
