#include "trials.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "palpate/simulation.hpp"
#include "random.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t seeds_per_shape = 1'000'000;  ///< more trials begin with the same ones

int symmetry_of(const std::string& letter) { return letter == "I" ? 2 : letter == "O" ? 0 : 1; }

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

LearnedLetters learn_letters(Device& device, const MapOptions& options,
                             const std::vector<Recording>& training) {
  LearnedLetters learned{.objects = letter_maps(device, training, options), .bodies = {}};
  for (Hypothesis& object : learned.objects) {
    object.map.symmetry = symmetry_of(object.map.label);
    learned.bodies.push_back(body_of(object.map));
  }
  return learned;
}

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

std::size_t object_of(const LearnedLetters& learned, const std::string& label) {
  const auto object =
      std::find_if(learned.objects.begin(), learned.objects.end(),
                   [&](const Hypothesis& hypothesis) { return hypothesis.map.label == label; });
  if (object == learned.objects.end()) {
    throw Error(Fault::input, fmt::format("'{}' is no learned letter", label));
  }
  return static_cast<std::size_t>(object - learned.objects.begin());
}

Score score(const LearnedLetters& learned, const Estimate& estimate, const Truth& truth) {
  const auto best = std::max_element(estimate.identity.begin(), estimate.identity.end());
  const auto label = [&](std::ptrdiff_t object) -> const std::string& {
    return learned.objects[object].map.label;
  };
  Score score{.right = label(best - estimate.identity.begin()) == truth.object,
              .confidence = *best,
              .error_mm = {}};
  const Mode& mode = estimate.mode;
  if (label(mode.object) == truth.object) {
    score.error_mm = error_mm(learned, mode.object, mode.T_object_robot, truth);
  }
  return score;
}

double error_mm(const LearnedLetters& learned, int object, const Pose& T_object_robot,
                const Truth& truth) {
  return pose_error_mm(learned.bodies[object], learned.objects[object].map.symmetry, T_object_robot,
                       truth.T_object_robot);
}

}  // namespace palpate::bench
