#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

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

/// What is wrong with a whole number, or nothing. CLI11 alone reads 010 as octal and, where it
/// wants no sign, wraps -1 around and takes the largest number for one that is larger.
std::string require_whole_number(const std::string& text);

/// Throws Error unless a file can be made there: before hours of work, not after.
void require_writable(const std::filesystem::path& file);
/// Writes a file that appears whole or not at all. Throws Error.
void write_file(const std::filesystem::path& file, std::string_view bytes);
/// Makes the folder where it is missing. Throws Error where that fails.
void make_folder(const std::filesystem::path& folder);

double degrees(double rad);
double radians(double deg);

}  // namespace palpate::cli
