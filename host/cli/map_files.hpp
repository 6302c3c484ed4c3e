#pragma once

#include <filesystem>
#include <vector>

namespace palpate::cli {

/// The map files that an argument of --maps stands for: itself, or the maps of a folder.
std::vector<std::filesystem::path> map_files(const std::filesystem::path& argument);

}  // namespace palpate::cli
