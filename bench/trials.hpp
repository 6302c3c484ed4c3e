#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "letters.hpp"
#include "palpate/touch.hpp"

namespace palpate::bench {

/// Standard deviations of the pose that the robot reports for the array about the true one.
struct SensorPoseNoise {
  double translation_mm = 0.0;  ///< along x and y
  double rotation_rad = 0.0;    ///< about the array's centre
};

/// How unknowns are touched in trials.
struct TrialTouches {
  TouchingSensor sensor = {};
  bool at_random_poses = false;  ///< random_poses() in the place of the training set's
  SensorPoseNoise pose_noise = {};
};

/// The trials of Sec. IV, `trials_each` for every shape, shape by shape. A shape has one test set:
/// 192 readings, by default at the poses of the training set, but of another sensor's gains and
/// noise. A trial is a random T_object_robot, x and y uniform over [-10, 10] mm and theta over the
/// circle, and the first `touches` of the test set in a random order. More trials, or more touches,
/// begin with the same ones. The recordings carry the truth. With noise, each reading is the same
/// and its T_robot_sensor is off by normal numbers of its own.
/// @throws Error unless touches is from 1 to the test set's 192
std::vector<Recording> make_trials(std::span<const std::string> shapes, int trials_each,
                                   int touches, std::uint64_t seed, const TrialTouches& how = {});

}  // namespace palpate::bench
