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

/// What letters are touched with.
struct TouchingSensor {
  SensorModel model = {};
  std::vector<glm::dvec2> elements_mm = digitacts_array();
};

/// The objects of Sec. IV.
inline const std::vector<std::string> vowels = {"A", "E", "I", "O", "U"};

/// The vowels, touched at known poses T_object_sensor, with fixed seeds.
std::vector<Recording> training_recordings(const TouchingSensor& sensor = {},
                                           const std::vector<Pose>& poses = training_grid());

/// The letters' maps, which share the prior that their training touches give, with the symmetries
/// of Eq. 18-20: 2 for I, 0 (full) for O, 1 for the others.
std::vector<Hypothesis> letter_maps(Device& device, const std::vector<Recording>& training,
                                    const MapOptions& options);

/// Recordings of letters in random poses within the lattice, A to U in turn, with the truth.
std::vector<Recording> unknown_recordings(int count, int touches, std::uint64_t seed);

/// Every touch of a recording.
std::vector<Touch> all_touches(const Recording& recording);

/// Bins over x and y in [-10, 10] mm and the full circle (Sec. IV).
PoseLattice lattice_of(int nx, int ny, int ntheta);
/// Its numbers of bins, such as "25x25x16".
std::string size_of(const PoseLattice& lattice);

}  // namespace palpate::bench
