#pragma once

#include <filesystem>
#include <vector>

#include <glm/vec2.hpp>

namespace palpate {

/// Reads the polygons of a text file in mm, in the format that make_shape() describes.
/// @throws Error naming the file and line.
std::vector<std::vector<glm::dvec2>> read_polygons(const std::filesystem::path& path);

}  // namespace palpate
