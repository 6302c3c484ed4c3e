#pragma once

#include <cstdint>
#include <string>

#include "palpate/files.hpp"

namespace palpate {

/// A letter's map as it would be after very many touches, made without a device: log odds of 4
/// nats on the letter and -4 beside it, over 32 x 32 mm from the first cell's centre to the last
/// one's.
OccupancyGrid sample_map(const std::string& letter, double cell_mm = 1.0);

/// Simulated touches of a letter at this pose T_object_robot, which is stored as the truth.
Recording sample_unknown(const std::string& letter, const Pose& T_object_robot, int touches,
                         std::uint64_t seed = 20110509);

/// Simulated touches of a letter at known poses, to build a map of.
Recording sample_training(const std::string& letter, int touches);

/// Presses of an array of 16 x 16 elements, 2 mm apart, that sees a shape whole; the poses
/// T_object_sensor are within 3 mm of its middle.
Recording sample_presses(const std::string& shape, int presses, std::uint64_t seed);

/// The touches [begin, end) of a recording as one of their own.
Recording part_of(const Recording& recording, std::size_t begin, std::size_t end);

}  // namespace palpate
