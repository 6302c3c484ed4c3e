#pragma once

#include <cstdint>
#include <vector>

#include "letters.hpp"

namespace palpate::bench {

/// Most objects that glyph_recordings() makes.
inline constexpr int most_glyphs = 108;

/// `count` objects, touched at the training poses: the letters A to Z, then the digits, then both
/// at 0.8 and at 1.2 times the size.
/// @throws Error unless count is from 1 to most_glyphs
std::vector<Recording> glyph_recordings(int count);

/// Unknowns among the first `count` glyphs, in turn, at random poses T_object_robot: x and y within
/// `extent_mm` of 0, any angle. The touches are at random poses about the object.
std::vector<Recording> glyph_unknowns(int count, int unknowns, int touches, double extent_mm,
                                      std::uint64_t seed);

}  // namespace palpate::bench
