#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "learning/sensor_calibration.hpp"
#include "learning/table_learning.hpp"
#include "palpate/simulation.hpp"
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
           std::uint64_t seed) {
    Uniform random(seed);
    for (std::size_t i = 0; i < count; ++i) {
      const Pose pose{{random(-3.0, 3.0), random(-3.0, 3.0)}, random(0.0, two_pi)};
      Recording recording;
      recording.path = label + std::to_string(i) + ".h5";
      recording.object = label;
      recording.elements_mm = grid_array(14, 14, 1.5);
      recording.T_robot_sensor = {Pose{}};
      for (const glm::dvec2& element : recording.elements_mm) {
        const double contact = shape(pose * element) ? 0.9 : 0.05;
        recording.pressure.push_back(random(0.0, 1.0) < contact ? 10.0 : 0.0);
      }
      recordings.push_back(std::move(recording));
      T_object_robot.push_back(pose);
    }
    presses.clear();
    for (const Recording& recording : recordings) {
      presses.push_back(single_press(recording, 0));
    }
  }
  /// Adds presses of the letter L, and as many of the disc.
  void add_shapes(std::size_t count, std::uint64_t seed) {
    add(on_letter_l, "L", count, seed);
    add(on_disc, "disc", count, seed + 1);
  }
};

/// Every touch of a recording as a press at a known pose.
inline std::vector<Press> posed_presses(const Recording& recording) {
  std::vector<Press> presses;
  for (std::size_t touch = 0; touch < recording.size(); ++touch) {
    presses.push_back(posed_press(recording, touch));
  }
  return presses;
}

/// How presses are mapped, and a table is learned on such maps.
inline MapOptions map_options() {
  return {.cell_mm = 0.75, .sensor = {.spread_mm = 0.75, .prior = 0.2}};
}
inline TableLearning learning_on(const std::vector<TrainingMap>& maps) {
  return {.layer = {.near_mm = 3.0, .far_mm = 9.0},
          .contact = {.prior = 0.2},
          .lattice = placing_lattice(maps, 1.5, two_pi / 24.0)};
}

/// A number of the standard normal distribution.
inline double normal(Uniform& random) {
  return std::sqrt(-2.0 * std::log(random(1e-12, 1.0))) * std::cos(two_pi * random(0.0, 1.0));
}

/// Whether a calibration warns of this.
inline bool warns(const SensorCalibration& found, const std::string& part) {
  return std::ranges::any_of(found.warnings, [&](const std::string& warning) {
    return warning.find(part) != std::string::npos;
  });
}

/// Touches of simulated letters by the DigiTacts array.
struct LetterPresses {
  std::vector<Recording> recordings;  ///< one of each letter
  std::vector<Press> presses;         ///< their touches

  void add(const std::string& letter, const std::vector<Pose>& T_object_sensor,
           std::uint64_t seed) {
    recordings.push_back(
        Simulator(make_shape(letter), {}, digitacts_array(), seed).touch(T_object_sensor, {}));
    recordings.back().path = letter + ".h5";
    make_presses(true);
  }
  /// Adds touches at random poses.
  void add(const std::string& letter, int touches, std::uint64_t seed) {
    add(letter, random_poses(touches, seed), seed);
  }
  /// Makes presses of the recordings as they are now.
  void make_presses(bool posed) {
    presses.clear();
    for (const Recording& recording : recordings) {
      for (std::size_t touch = 0; touch < recording.size(); ++touch) {
        presses.push_back(posed ? posed_press(recording, touch) : single_press(recording, touch));
      }
    }
  }
};

/// Touches of an A and a U.
inline LetterPresses two_letters(int of_a, int of_u, std::uint64_t seed) {
  LetterPresses letters;
  letters.add("A", of_a, seed);
  letters.add("U", of_u, seed + 1);
  return letters;
}

}  // namespace palpate
