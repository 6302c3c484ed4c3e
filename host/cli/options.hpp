#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "palpate/pose.hpp"

namespace palpate::cli {

// Each parses the value of a flag. They throw Error naming the flag, the value and the form.

/// "A:B" with A <= B.
std::array<double, 2> parse_range(const std::string& flag, const std::string& text);
/// "X,Y"
glm::dvec2 parse_point(const std::string& flag, const std::string& text);
/// "X,Y,DEG"
Pose parse_pose(const std::string& flag, const std::string& text);
/// "25x25x16", each at least 1
std::array<int, 3> parse_bins(const std::string& flag, const std::string& text);

/// A half-open range of touches.
struct Frames {
  std::size_t begin = 0;
  std::size_t end = 0;
};
/// "A:B" with A < B
Frames parse_frames(const std::string& flag, const std::string& text);

/// Throws Error unless the value is finite and above `least` (or equal to it, if `inclusive`).
double require_above(const std::string& flag, double value, double least, bool inclusive = false);

/// Throws Error unless a file can be made there: before hours of work, not after.
void require_folder_of(const std::filesystem::path& file);
/// Makes the folder where it is missing. Throws Error where that fails.
void make_folder(const std::filesystem::path& folder);

double degrees(double rad);
double radians(double deg);

}  // namespace palpate::cli
