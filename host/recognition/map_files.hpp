#pragma once

#include <filesystem>
#include <vector>

namespace palpate {

/// The map files that an argument of --maps stands for: itself or, of a folder, its *.map.h5 and
/// what else is a map among its *.h5. @throws Error where a folder has none
std::vector<std::filesystem::path> map_files(const std::filesystem::path& argument);

}  // namespace palpate
