#include "recognition/map_files.hpp"

#include <algorithm>
#include <system_error>

#include "io/input_file.hpp"
#include "palpate/files.hpp"

namespace palpate {

std::vector<std::filesystem::path> maps_in(const std::filesystem::path& folder) {
  std::error_code error;
  std::vector<std::filesystem::path> files;
  const std::filesystem::directory_iterator entries(folder, error);
  if (error) {
    refuse(folder, "cannot be read: {}; check its permissions", error.message());
  }
  for (const auto& entry : entries) {
    // A look into each file would take as long as reading it.
    if (entry.path().filename().string().ends_with(".map.h5") ||
        (entry.path().extension() == ".h5" && read_format(entry.path()) == "palpate.map")) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::filesystem::path> map_files(const std::filesystem::path& argument) {
  std::error_code error;
  if (!std::filesystem::is_directory(argument, error)) {
    return {argument};
  }
  std::vector<std::filesystem::path> files = maps_in(argument);
  if (files.empty()) {
    refuse(argument, "a folder without maps; build some with palpate map RECORDING... -o {}",
           (argument / "").string());
  }
  return files;
}

}  // namespace palpate
