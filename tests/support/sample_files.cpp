#include "support/sample_files.hpp"

#include <cmath>

#include "palpate/simulation.hpp"

namespace palpate {

OccupancyGrid sample_map(const std::string& letter, double cell_mm) {
  const Shape shape = make_shape(letter);
  OccupancyGrid map;
  map.label = letter;
  map.cell_mm = cell_mm;
  map.origin_mm = {-16.0, -16.0};
  map.nx = 1 + static_cast<int>(std::lround(32.0 / cell_mm));
  map.ny = map.nx;
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      map.log_odds.push_back(shape.contains(map.centre_mm(i, j)) ? 4.0F : -4.0F);
    }
  }
  return map;
}

Recording sample_unknown(const std::string& letter, const Pose& T_object_robot, int touches,
                         std::uint64_t seed) {
  std::vector<Pose> T_robot_sensor = random_poses(touches, seed);
  for (Pose& pose : T_robot_sensor) {
    pose = inverse(T_object_robot) * pose;
  }
  Recording recording = Simulator(make_shape(letter), {}, digitacts_array(), seed)
                            .touch(T_robot_sensor, T_object_robot);
  recording.object.clear();
  recording.truth = {.object = letter, .T_object_robot = T_object_robot};
  return recording;
}

Recording sample_training(const std::string& letter, int touches) {
  Recording recording = sample_unknown(letter, {}, touches);
  recording.object = letter;
  recording.truth.reset();
  return recording;
}

Recording sample_presses(const std::string& shape, int presses, std::uint64_t seed) {
  std::vector<Pose> T_object_sensor = random_poses(presses, seed);
  for (Pose& pose : T_object_sensor) {
    pose.translation_mm *= 0.3;
  }
  return Simulator(make_shape(shape), {}, grid_array(16, 16, 2.0), seed).touch(T_object_sensor, {});
}

Recording part_of(const Recording& recording, std::size_t begin, std::size_t end) {
  const auto rows = [&](auto& values, std::size_t width) {
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(end * width), values.end());
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(begin * width));
  };
  Recording part = recording;
  rows(part.pressure, recording.elements());
  rows(part.T_robot_sensor, 1);
  part.time_s.clear();
  return part;
}

}  // namespace palpate
