// Recognises what a sensor touches while it touches: a board, a replay or a simulation.
//   live_stream takktile MAP.h5...
//   live_stream simulate:E,speed=max,object=random,touches=9 MAP.h5...
// Draws the belief over x and y after the first touch, and the last pose, in live_stream.svg.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <vector>

#include <palpate/driver.hpp>
#include <palpate/palpate.hpp>

#include "picture.hpp"

/// The probability of each x and y, by its logarithm: white is a thousandth of the largest, or
/// less.
Picture picture_of(const palpate::Marginals& marginals) {
  const int nx = marginals.grid.x_mm.count;
  const int ny = marginals.grid.y_mm.count;
  const double most = *std::max_element(marginals.xy.begin(), marginals.xy.end());
  Picture picture(nx, ny);
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) {
      const double share = marginals.xy[y * nx + x] / most;
      picture.cell(x, y, share > 1e-3 ? -1.0 - std::log10(share) / 3.0 : 0.0);
    }
  }
  return picture;
}

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::cerr << "usage: live_stream SENSOR MAP.h5...\n";
    return 2;
  }
  const std::string name = argv[1];
  // A board does not know where it is: palpate::PosedSensor adds the robot's poses to its frames.
  const std::unique_ptr<palpate::Sensor> sensor = palpate::is_virtual_sensor(name)
                                                      ? palpate::open_virtual_sensor(name)
                                                      : palpate::open_board(name);
  std::vector<palpate::Hypothesis> known;
  for (int i = 2; i < argc; ++i) known.push_back({.map = palpate::read_map(argv[i])});

  palpate::Device device = palpate::Device::open();
  palpate::PoseHistogram belief(device, known,
                                {.lattice = {{-20, 20, 80}, {-20, 20, 80}, {0, 6.283185307, 120}}});
  const palpate::SensorDescription& array = sensor->description();
  sensor->start();
  // Nothing touches the array at first: half a second gives its baseline.
  std::vector<palpate::Frame> untouched;
  while (untouched.size() < 50) {
    if (auto frame = sensor->next(std::chrono::seconds(1))) untouched.push_back(std::move(*frame));
  }
  palpate::TouchDetector detector({}, palpate::baseline_of(untouched, array, {}), array.valid);

  std::optional<Picture> picture;
  while (!sensor->ended()) {
    const auto frame = sensor->next(std::chrono::milliseconds(100));
    const auto touch = frame ? detector.add(*frame) : std::nullopt;
    if (!touch || !touch->T_robot_sensor) continue;
    belief.update({*touch->T_robot_sensor, array.elements_mm, touch->pressure, touch->valid});
    const palpate::Estimate estimate = belief.estimate();
    const palpate::ObjectPose pose = inverse(belief.refine(estimate.mode));
    std::cout << known[estimate.mode.object].map.label << " with probability "
              << estimate.identity[estimate.mode.object] << " at "
              << pose.T_robot_object.translation_mm.x << ", "
              << pose.T_robot_object.translation_mm.y << " mm" << std::endl;
    if (!picture) picture = picture_of(belief.marginals(estimate.mode.object));
  }

  if (picture) {
    const palpate::PoseLattice& bins = belief.lattice();
    const palpate::Mode mode = belief.estimate().mode;
    const glm::dvec2 refined = belief.refine(mode).T_object_robot.translation_mm;
    picture->circle((refined.x - bins.x_mm.centre(0)) / bins.x_mm.step(),
                    (refined.y - bins.y_mm.centre(0)) / bins.y_mm.step(), 3.0,
                    R"(fill="none" stroke="#000" stroke-width=".5")");
    picture->save("live_stream.svg");
  }
} catch (const palpate::Error& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
