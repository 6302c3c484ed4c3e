#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "palpate/device.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/simulation.hpp"

namespace palpate::bench {

inline constexpr int touches_per_unknown = 9;  // after which the paper knows every letter

/// The objects of Sec. IV: A, E, I, O and U, touched at known poses, with fixed seeds.
std::vector<Recording> training_recordings();

/// Maps of 0.5 mm cells, which share the prior that their training touches give, with the
/// symmetries of Eq. 18-20: 2 for I, 0 (full) for O, 1 for the others.
std::vector<Hypothesis> letter_maps(Device& device, const std::vector<Recording>& training);

/// Recordings of letters in random poses within the lattice, A to U in turn, with the truth.
std::vector<Recording> unknown_recordings(int count, int touches, std::uint64_t seed);

/// Most objects that glyph_recordings() makes.
inline constexpr int most_glyphs = 108;

/// `count` objects, touched at the training poses: the letters A to Z, then the digits, then both
/// at 0.8 and at 1.2 times the size.
std::vector<Recording> glyph_recordings(int count);

/// Unknowns among the first `count` glyphs, in turn, at random poses T_object_robot: x and y within
/// `extent_mm` of 0, any angle. The touches are at random poses about the object.
std::vector<Recording> glyph_unknowns(int count, int unknowns, int touches, double extent_mm,
                                      std::uint64_t seed);

/// Every touch of a recording.
std::vector<Touch> all_touches(const Recording& recording);

/// Bins over x and y in [-10, 10] mm and the full circle (Sec. IV).
PoseLattice lattice_of(int nx, int ny, int ntheta);
/// Its numbers of bins, such as "25x25x16".
std::string size_of(const PoseLattice& lattice);

}  // namespace palpate::bench
