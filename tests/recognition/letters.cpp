#include "letters.hpp"

#include "palpate/map_builder.hpp"
#include "palpate/simulation.hpp"
#include "support/shared_device.hpp"

namespace palpate {

OccupancyGrid learned_map(const std::string& shape) {
  const Recording training =
      Simulator(make_shape(shape), {}, digitacts_array(), 1).touch(training_grid(), {});
  MapBuilder builder(shared_device(), {});
  builder.add(training.touches(0, training.size()));
  return builder.build(shape);
}

const std::vector<Hypothesis>& learned_letters() {
  static const std::vector<Hypothesis> letters = [] {
    std::vector<Hypothesis> learned;
    for (const auto& [letter, symmetry] : {std::pair{"A", 1}, std::pair{"E", 1}, std::pair{"I", 2},
                                           std::pair{"O", 0}, std::pair{"U", 1}}) {
      learned.push_back({.map = learned_map(letter)});
      learned.back().map.symmetry = symmetry;
    }
    return learned;
  }();
  return letters;
}

Recording letter_touches(const std::string& letter, int touches, std::uint64_t seed) {
  Pose T_object_robot = random_object_pose(seed);
  T_object_robot.translation_mm *= 0.8;
  std::vector<Pose> T_robot_sensor = random_poses(touches, seed);
  for (Pose& pose : T_robot_sensor) {
    pose = inverse(T_object_robot) * pose;
  }
  Recording recording = Simulator(make_shape(letter), {}, digitacts_array(), seed)
                            .touch(T_robot_sensor, T_object_robot);
  recording.path = letter;
  recording.truth = {.object = letter, .T_object_robot = T_object_robot};
  return recording;
}

}  // namespace palpate
