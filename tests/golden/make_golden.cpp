// Simulates training touches and unknowns of three letters and writes them, with the reference's
// results, to the file that golden_test reads: make_golden tests/golden/golden.json

#include <cstdio>
#include <numbers>
#include <utility>

#include "golden_values.hpp"
#include "palpate/simulation.hpp"

namespace palpate {
namespace {

/// The recording with its numbers rounded as in the file.
Recording as_written(Recording recording) {
  for (double& pressure : recording.pressure) {
    pressure = rounded(pressure);
  }
  for (Pose& pose : recording.T_robot_sensor) {
    pose = {{rounded(pose.translation_mm.x), rounded(pose.translation_mm.y)},
            rounded(pose.theta_rad)};
  }
  return recording;
}

GoldenValues simulate() {
  GoldenValues golden;
  golden.map_options.cell_mm = 1.0;
  golden.histogram_options = {.lattice = {.x_mm = {-9.0, 9.0, 9},
                                          .y_mm = {-9.0, 9.0, 9},
                                          .theta_rad = {0.0, rounded(2.0 * std::numbers::pi), 8},
                                          .pivot_mm = {3.0, -2.0}},
                              .contact = {.classifier = golden.map_options.classifier,
                                          .prior = golden.map_options.sensor.prior}};

  // A quarter of the training grid still reaches every part of a letter, at 3 angles.
  std::vector<Pose> training;
  for (std::size_t i = 0; i < training_grid().size(); i += 4) {
    training.push_back(training_grid()[i]);
  }
  constexpr std::pair<const char*, int> letters[] = {{"A", 1}, {"I", 2}, {"O", 0}};
  std::uint64_t seed = 0;
  for (const auto& [label, symmetry] : letters) {
    Simulator sensor(make_shape(label), {}, digitacts_array(), ++seed);
    GoldenValues::Object object;
    object.training = as_written(sensor.touch(training, {}));
    object.map = {.label = label,
                  .cell_mm = golden.map_options.cell_mm,
                  .origin_mm = {-20.0, -20.0},
                  .prior = golden.map_options.sensor.prior,
                  .symmetry = symmetry,
                  .nx = 41,
                  .ny = 41,
                  .log_odds = {}};
    golden.objects.push_back(std::move(object));

    // The unknown lies somewhere within the lattice; the robot knows where its sensor touches.
    const Pose drawn = random_object_pose(seed);
    const Pose T_object_robot{
        {rounded(0.7 * drawn.translation_mm.x), rounded(0.7 * drawn.translation_mm.y)},
        rounded(drawn.theta_rad)};
    std::vector<Pose> T_robot_sensor;
    for (const Pose& T_object_sensor : random_poses(6, seed)) {
      T_robot_sensor.push_back(inverse(T_object_robot) * T_object_sensor);
    }
    GoldenValues::Unknown unknown;
    unknown.touches = as_written(sensor.touch(T_robot_sensor, T_object_robot));
    unknown.touches.truth = Truth{label, T_object_robot};
    golden.unknowns.push_back(std::move(unknown));
  }
  return golden;
}

}  // namespace
}  // namespace palpate

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: make_golden FILE.json\n", stderr);
    return 2;
  }
  palpate::GoldenValues golden = palpate::simulate();
  palpate::compute_expected(golden);
  palpate::write_golden(argv[1], golden);
}
