#include "glyph_scene.hpp"

#include <array>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "palpate/simulation.hpp"

namespace palpate::bench {

namespace {

constexpr std::string_view characters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
constexpr std::array scales{1.0, 0.8, 1.2};
static_assert(characters.size() * scales.size() == most_glyphs);

constexpr double drawn_within_mm = 10.0;  ///< by random_object_pose()

Shape glyph(int i) {
  const auto at = static_cast<std::size_t>(i);
  const double scale = scales[at / characters.size()];
  Shape shape = make_shape(std::string(1, characters[at % characters.size()]));
  for (Shape::Stroke& stroke : shape.strokes) {
    stroke.width_mm *= scale;
    for (glm::dvec2& point_mm : stroke.points_mm) {
      point_mm *= scale;
    }
  }
  if (scale != 1.0) {
    shape.label += fmt::format(" x {}", scale);
  }
  return shape;
}

Simulator simulator_of(int i, std::uint64_t seed) {
  return {glyph(i), SensorModel{}, digitacts_array(), seed};
}

}  // namespace

std::vector<Recording> glyph_recordings(int count) {
  if (count < 1 || count > most_glyphs) {
    throw Error(Fault::input, fmt::format("objects = {}: give 1 to {}", count, most_glyphs));
  }
  std::vector<Recording> recordings;
  for (int i = 0; i < count; ++i) {
    recordings.push_back(
        simulator_of(i, static_cast<std::uint64_t>(i) + 1).touch(training_grid(), Pose{}));
  }
  return recordings;
}

std::vector<Recording> glyph_unknowns(int count, int unknowns, int touches, double extent_mm,
                                      std::uint64_t seed) {
  std::vector<Recording> recordings;
  for (int i = 0; i < unknowns; ++i) {
    Simulator simulator = simulator_of(i % count, ++seed);
    Pose T_object_robot = random_object_pose(++seed);
    T_object_robot.translation_mm *= extent_mm / drawn_within_mm;
    std::vector<Pose> poses = random_poses(touches, ++seed);
    for (Pose& pose : poses) {
      pose = inverse(T_object_robot) * pose;  // T_robot_sensor from T_object_sensor
    }
    Recording& recording = recordings.emplace_back(simulator.touch(poses, T_object_robot));
    recording.truth = {.object = recording.object, .T_object_robot = T_object_robot};
  }
  return recordings;
}

}  // namespace palpate::bench
