#include "letters.hpp"

#include <array>
#include <numbers>

#include <fmt/format.h>

namespace palpate::bench {

namespace {

constexpr std::string_view vowels = "AEIOU";
constexpr std::string_view characters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789";
constexpr std::array scales{1.0, 0.8, 1.2};
static_assert(characters.size() * scales.size() == most_glyphs);

constexpr double drawn_within_mm = 10.0;  ///< by random_object_pose()

Simulator simulator_of(char character, std::uint64_t seed, double scale = 1.0) {
  Shape shape = make_shape(std::string(1, character));
  for (Shape::Stroke& stroke : shape.strokes) {
    stroke.width_mm *= scale;
    for (glm::dvec2& point_mm : stroke.points_mm) {
      point_mm *= scale;
    }
  }
  if (scale != 1.0) {
    shape.label += fmt::format(" x {}", scale);
  }
  return {shape, SensorModel{}, digitacts_array(), seed};
}

Simulator glyph_simulator(int i, std::uint64_t seed) {
  const auto at = static_cast<std::size_t>(i);
  return simulator_of(characters[at % characters.size()], seed, scales[at / characters.size()]);
}

/// An unknown at a random pose, x and y within `extent_mm` of 0, touched at random poses about it,
/// with the truth. Draws from the two seeds after `seed`, which it leaves at the last.
Recording touched_at_random(Simulator& simulator, int touches, double extent_mm,
                            std::uint64_t& seed) {
  Pose T_object_robot = random_object_pose(++seed);
  T_object_robot.translation_mm *= extent_mm / drawn_within_mm;
  std::vector<Pose> poses = random_poses(touches, ++seed);
  for (Pose& pose : poses) {
    pose = inverse(T_object_robot) * pose;  // T_robot_sensor from T_object_sensor
  }
  Recording recording = simulator.touch(poses, T_object_robot);
  recording.truth = {.object = recording.object, .T_object_robot = T_object_robot};
  return recording;
}

}  // namespace

std::vector<Recording> training_recordings() {
  std::vector<Recording> recordings;
  for (const char letter : vowels) {
    recordings.push_back(
        simulator_of(letter, recordings.size() + 1).touch(training_grid(), Pose{}));
  }
  return recordings;
}

std::vector<Hypothesis> letter_maps(Device& device, const std::vector<Recording>& training) {
  std::vector<ObjectTouches> letters;
  for (const Recording& recording : training) {
    letters.push_back({recording.object, all_touches(recording)});
  }
  MapOptions options;
  options.sensor.prior = estimate_prior(device, letters, options);
  MapBuilder builder(device, options);
  std::vector<Hypothesis> hypotheses;
  for (const ObjectTouches& letter : letters) {
    builder.clear();
    builder.add(letter.touches);
    OccupancyGrid& map = hypotheses.emplace_back(Hypothesis{builder.build(letter.label)}).map;
    map.symmetry = letter.label == "I" ? 2 : letter.label == "O" ? 0 : 1;
  }
  return hypotheses;
}

std::vector<Recording> unknown_recordings(int count, int touches, std::uint64_t seed) {
  std::vector<Simulator> simulators;
  for (const char letter : vowels) {
    simulators.push_back(simulator_of(letter, ++seed));
  }
  std::vector<Recording> recordings;
  for (int i = 0; i < count; ++i) {
    Simulator& simulator = simulators[static_cast<std::size_t>(i) % simulators.size()];
    recordings.push_back(touched_at_random(simulator, touches, drawn_within_mm, seed));
  }
  return recordings;
}

std::vector<Recording> glyph_recordings(int count) {
  std::vector<Recording> recordings;
  for (int i = 0; i < count; ++i) {
    recordings.push_back(glyph_simulator(i, recordings.size() + 1).touch(training_grid(), Pose{}));
  }
  return recordings;
}

std::vector<Recording> glyph_unknowns(int count, int unknowns, int touches, double extent_mm,
                                      std::uint64_t seed) {
  std::vector<Recording> recordings;
  for (int i = 0; i < unknowns; ++i) {
    Simulator simulator = glyph_simulator(i % count, ++seed);
    recordings.push_back(touched_at_random(simulator, touches, extent_mm, seed));
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
