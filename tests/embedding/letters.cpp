#include "letters.hpp"

namespace palpate {

std::vector<Hypothesis> letter_maps(Device& device) {
  std::vector<Hypothesis> hypotheses;
  for (const char* letter : {"A", "E", "I"}) {
    Simulator sensor(make_shape(letter), SensorModel{}, digitacts_array(), /*seed=*/1);
    const Recording training = sensor.touch(training_grid(), Pose{});
    MapBuilder builder(device, MapOptions{});
    builder.add(training.touches(0, training.size()));
    hypotheses.push_back({.map = builder.build(letter)});
  }
  return hypotheses;
}

Recording unknown_letter(std::size_t touches) {
  const Pose T_object_robot{{3.0, -2.0}, 1.0};
  std::vector<Pose> T_robot_sensor = random_poses(static_cast<int>(touches), /*seed=*/2);
  for (Pose& pose : T_robot_sensor) {
    pose = inverse(T_object_robot) * pose;
  }
  Simulator sensor(make_shape("E"), SensorModel{}, digitacts_array(), /*seed=*/3);
  return sensor.touch(T_robot_sensor, T_object_robot);
}

PoseLattice small_lattice() {
  return {{-10.0, 10.0, 10}, {-10.0, 10.0, 10}, {0.0, 6.283185307179586, 16}};
}

}  // namespace palpate
