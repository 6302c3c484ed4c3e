#pragma once

#include <filesystem>
#include <vector>

#include <glm/vec2.hpp>

namespace palpate {

/// Reads the element centres of an array, in mm, from a text file: a line "x y" for each; '#'
/// starts a comment.
/// @throws Error naming the file and the line.
std::vector<glm::dvec2> read_elements(const std::filesystem::path& path);

}  // namespace palpate
