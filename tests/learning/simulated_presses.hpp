#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "learning/table_learning.hpp"
#include "palpate/simulation.hpp"
#include "palpate/touch.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate {

/// Presses by an array of 14 x 14 elements, 1.5 mm apart, on objects at unknown poses.
struct SimulatedPresses {
  std::vector<Recording> recordings;  ///< one press each
  std::vector<Press> presses;         ///< of the recordings
  std::vector<Pose> T_object_robot;   ///< the truth

  /// Adds presses of an object. An element on the object reads 10 with probability 0.9, and one
  /// beside it with probability 0.05; else 0.
  void add(const Silhouette& shape, const std::string& label, std::size_t count,
           std::uint64_t seed);
  /// Adds presses of the letter L, and as many of the disc.
  void add_shapes(std::size_t count, std::uint64_t seed);
};

/// Every touch of a recording as a press at a known pose.
std::vector<Press> posed_presses(const Recording& recording);

/// How presses are mapped, and a table is learned on such maps.
MapOptions map_options();
TableLearning learning_on(const std::vector<TrainingMap>& maps);

/// A number of the standard normal distribution.
double normal(Uniform& random);

/// Touches of simulated letters by the DigiTacts array.
struct LetterPresses {
  std::vector<Recording> recordings;  ///< one of each letter
  std::vector<Press> presses;         ///< their touches

  void add(const std::string& letter, const std::vector<Pose>& T_object_sensor, std::uint64_t seed,
           const SensorModel& model = {});
  /// Adds touches at random poses.
  void add(const std::string& letter, int touches, std::uint64_t seed,
           const SensorModel& model = {}) {
    add(letter, random_poses(touches, seed), seed, model);
  }
  /// Makes presses of the recordings as they are now.
  void make_presses(bool posed);
};

}  // namespace palpate
