#include "trials.hpp"

#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "model/random.hpp"
#include "palpate/error.hpp"
#include "palpate/simulation.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t seeds_per_shape = 1'000'000;  ///< more trials begin with the same ones

/// 0 to n - 1 in a random order (Fisher and Yates).
std::vector<std::size_t> random_order(std::size_t n, std::uint64_t seed) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), 0);
  Random random(seed, Stream::touch_order);
  for (std::size_t i = 0; i + 1 < n; ++i) {
    const double rest = static_cast<double>(n - i);
    std::swap(order[i], order[i + static_cast<std::size_t>(random.uniform(0.0, rest))]);
  }
  return order;
}

/// Touches of an object whose frame was the robot's, as a robot meets them at T_object_robot.
Recording trial_of(const Recording& test_set, int touches, std::uint64_t seed,
                   const TrialTouches& how) {
  const std::vector<std::size_t> order = random_order(test_set.size(), seed);
  const Pose T_object_robot = random_object_pose(seed);
  Random random(seed, Stream::pose_noise);
  Recording trial;
  trial.elements_mm = test_set.elements_mm;
  trial.truth = {.object = test_set.object, .T_object_robot = T_object_robot};
  for (int i = 0; i < touches; ++i) {
    const Touch touch = test_set.touch(order[i]);
    const double dx_mm = how.pose_noise.translation_mm * random.normal();
    const double dy_mm = how.pose_noise.translation_mm * random.normal();
    const Pose T_sensor_reported{{dx_mm, dy_mm}, how.pose_noise.rotation_rad * random.normal()};
    trial.T_robot_sensor.push_back(inverse(T_object_robot) * touch.T_robot_sensor *
                                   T_sensor_reported);
    trial.pressure.insert(trial.pressure.end(), touch.pressure.begin(), touch.pressure.end());
  }
  return trial;
}

}  // namespace

std::vector<Recording> make_trials(std::span<const std::string> shapes, int trials_each,
                                   int touches, std::uint64_t seed, const TrialTouches& how) {
  const std::vector<Pose> grid = training_grid();
  const std::vector<Pose> poses =
      how.at_random_poses ? random_poses(static_cast<int>(grid.size()), seed) : grid;
  if (touches < 1 || static_cast<std::size_t>(touches) > poses.size()) {
    throw Error(Fault::input, fmt::format("touches per trial = {}: give 1 to {}, which is what "
                                          "there is to draw from without replacement",
                                          touches, poses.size()));
  }
  std::vector<Recording> trials;
  for (const std::string& shape : shapes) {
    Simulator simulator(make_shape(shape), how.sensor.model, how.sensor.elements_mm, seed);
    const Recording test_set = simulator.touch(poses, Pose{});
    for (int i = 0; i < trials_each; ++i) {
      trials.push_back(trial_of(test_set, touches, seed + i, how));
    }
    seed += seeds_per_shape;
  }
  return trials;
}

}  // namespace palpate::bench
