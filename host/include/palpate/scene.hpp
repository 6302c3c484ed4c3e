#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"

namespace palpate {

/// Contents of a scene file; what the file leaves out is empty here. A flag of the command line
/// overrides its key.
struct Scene {
  /// An object to recognise. Its label, symmetry and mirror, where given, override the map's own.
  struct Object {
    std::filesystem::path map;
    std::optional<std::string> label;
    std::optional<int> symmetry;  ///< n-fold; 0 = full
    std::optional<bool> mirror;   ///< OccupancyGrid::mirror
    double weight = 1.0;          ///< prior weight, relative to the other objects'
  };

  std::vector<Object> objects;
  std::optional<std::vector<glm::dvec2>> array_mm;  ///< element centres in the sensor frame
  std::optional<std::filesystem::path> array_file;  ///< file of `array_mm`, if any
  /// [option] its value, spelled as for the command's flag: {"x-mm", "-10:10"}
  std::map<std::string, std::string> options;
};

/// Reads a YAML scene file. Its relative paths start from its folder; returned paths include it.
/// `array` is "digitacts", a file as `palpate import --array` takes it, of which only the places
/// are read, or a list of [x, y] in mm.
/// @throws Error (Fault::input) naming the file, line, key, value and remedy, also on an unknown
/// key or one given twice
PALPATE_API Scene read_scene(const std::filesystem::path& path);

}  // namespace palpate
