#include "letters.hpp"

#include <numbers>
#include <string>

#include <fmt/format.h>

namespace palpate::bench {

namespace {

int symmetry_of(const std::string& letter) { return letter == "I" ? 2 : letter == "O" ? 0 : 1; }

Simulator simulator_of(const std::string& name, const TouchingSensor& sensor, std::uint64_t seed) {
  return {make_shape(name), sensor.model, sensor.elements_mm, seed};
}

}  // namespace

std::vector<Recording> training_recordings(const TouchingSensor& sensor,
                                           const std::vector<Pose>& poses) {
  std::vector<Recording> recordings;
  std::uint64_t seed = 1;
  for (const std::string& name : vowels) {
    recordings.push_back(simulator_of(name, sensor, seed++).touch(poses, Pose{}));
  }
  return recordings;
}

std::vector<Hypothesis> letter_maps(Device& device, const std::vector<Recording>& training,
                                    const MapOptions& options) {
  std::vector<ObjectTouches> letters;
  for (const Recording& recording : training) {
    letters.push_back({recording.object, all_touches(recording)});
  }
  MapOptions with_prior = options;
  with_prior.sensor.prior = estimate_prior(device, letters, options);
  MapBuilder builder(device, with_prior);
  std::vector<Hypothesis> hypotheses;
  for (const ObjectTouches& letter : letters) {
    builder.clear();
    builder.add(letter.touches);
    Hypothesis& hypothesis =
        hypotheses.emplace_back(Hypothesis{.map = builder.build(letter.label)});
    hypothesis.map.symmetry = symmetry_of(letter.label);
  }
  return hypotheses;
}

std::vector<Recording> unknown_recordings(int count, int touches, std::uint64_t seed) {
  std::vector<Simulator> simulators;
  for (const std::string& name : vowels) {
    simulators.push_back(simulator_of(name, {}, ++seed));
  }
  std::vector<Recording> recordings;
  for (int i = 0; i < count; ++i) {
    const std::size_t letter = static_cast<std::size_t>(i) % simulators.size();
    const Pose T_object_robot = random_object_pose(++seed);
    std::vector<Pose> poses = random_poses(touches, ++seed);
    for (Pose& pose : poses) {
      pose = inverse(T_object_robot) * pose;  // T_robot_sensor from T_object_sensor
    }
    recordings.push_back(simulators[letter].touch(poses, T_object_robot));
    recordings.back().truth = {.object = vowels[letter], .T_object_robot = T_object_robot};
  }
  return recordings;
}

std::vector<Touch> all_touches(const Recording& recording) {
  return recording.touches(0, recording.size());
}

PoseLattice lattice_of(int nx, int ny, int ntheta) {
  return {.x_mm = {-10.0, 10.0, nx},
          .y_mm = {-10.0, 10.0, ny},
          .theta_rad = {0.0, 2.0 * std::numbers::pi, ntheta}};
}

std::string size_of(const PoseLattice& lattice) {
  return fmt::format("{}x{}x{}", lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count);
}

}  // namespace palpate::bench
