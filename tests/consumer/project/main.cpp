#include <iostream>
#include <palpate/palpate.hpp>

int main() {
  using namespace palpate;
  Device device = Device::open();
  std::vector<Hypothesis> hypotheses;
  for (const char* letter : {"A", "E", "I"}) {  // learn each letter from touches at known poses
    Simulator sensor(make_shape(letter), SensorModel{}, digitacts_array(), /*seed=*/1);
    const Recording training = sensor.touch(training_grid(), Pose{});
    MapBuilder builder(device, MapOptions{});
    builder.add(training.touches(0, training.size()));
    hypotheses.push_back({.map = builder.build(letter)});
  }
  const Pose T_object_robot{{3.0, -2.0}, 1.0};  // the true pose of the unknown object, an E
  std::vector<Pose> T_robot_sensor = random_poses(9, /*seed=*/2);
  for (Pose& pose : T_robot_sensor) pose = inverse(T_object_robot) * pose;
  Simulator sensor(make_shape("E"), SensorModel{}, digitacts_array(), /*seed=*/3);
  const Recording unknown = sensor.touch(T_robot_sensor, T_object_robot);
  PoseHistogram belief(device, hypotheses, HistogramOptions{});  // over all letters and poses
  belief.update(unknown.touches(0, unknown.size()));
  const Estimate estimate = belief.estimate();
  const OccupancyGrid& map = hypotheses[estimate.mode.object].map;
  const Pose& T = estimate.mode.T_object_robot;
  std::cout << map.label << " with probability " << estimate.identity[estimate.mode.object]
            << " at " << T.translation_mm.x << ", " << T.translation_mm.y << " mm, " << T.theta_rad
            << " rad\n";
  return map.label == "E" && pose_error_mm(body_of(map), 1, T, T_object_robot) < 2.0 ? 0 : 1;
}
