#pragma once

#include <array>
#include <string>

#include "palpate/pose.hpp"
#include "recognition/request.hpp"

namespace palpate {

// Each function reads a text, as flags and manifests have it. Throws Error naming `what` the text
// is of, the text and the form wanted.

/// "A:B"
std::array<double, 2> parse_range(const std::string& what, const std::string& text);
/// "X,Y"
glm::dvec2 parse_point(const std::string& what, const std::string& text);
/// "X,Y,DEG"
Pose parse_pose(const std::string& what, const std::string& text);
/// "25x25x16"
std::array<int, 3> parse_bins(const std::string& what, const std::string& text);
/// "A:B" with A < B
Frames parse_frames(const std::string& what, const std::string& text);

}  // namespace palpate
