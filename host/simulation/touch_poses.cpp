#include <numbers>

#include <fmt/format.h>

#include "model/random.hpp"
#include "palpate/error.hpp"
#include "palpate/simulation.hpp"

namespace palpate {

namespace {

constexpr double pitch_mm = 6.8;
constexpr double reach_mm = 1.5 * pitch_mm;  ///< outermost of the 4 positions
constexpr double turn_rad = 2.0 * std::numbers::pi;

}  // namespace

std::vector<Pose> training_grid() {
  constexpr int angles = 12;
  std::vector<Pose> poses;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      for (int angle = 0; angle < angles; ++angle) {
        poses.push_back(
            {{column * pitch_mm - reach_mm, row * pitch_mm - reach_mm}, angle * turn_rad / angles});
      }
    }
  }
  return poses;
}

std::vector<Pose> random_poses(int n, std::uint64_t seed) {
  if (n < 0) {
    throw Error(Fault::input, fmt::format("number of random poses = {}: give zero or more", n));
  }
  Random random(seed, Stream::touch_poses);
  std::vector<Pose> poses(n);
  for (Pose& pose : poses) {
    // One draw per statement: within a statement the compiler chooses the order of evaluation.
    pose.translation_mm.x = random.uniform(-reach_mm, reach_mm);
    pose.translation_mm.y = random.uniform(-reach_mm, reach_mm);
    pose.theta_rad = random.uniform(0.0, turn_rad);
  }
  return poses;
}

Pose random_object_pose(std::uint64_t seed) {
  Random random(seed, Stream::object_pose);
  Pose T_object_robot;
  T_object_robot.translation_mm.x = random.uniform(-10.0, 10.0);
  T_object_robot.translation_mm.y = random.uniform(-10.0, 10.0);
  T_object_robot.theta_rad = random.uniform(0.0, turn_rad);
  return T_object_robot;
}

}  // namespace palpate
