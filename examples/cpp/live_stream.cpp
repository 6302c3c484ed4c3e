// Recognises what a sensor touches while it touches: a board, a replay or a simulation.
//   live_stream takktile MAP.h5...
//   live_stream simulate:E,speed=max,object=random,touches=9 MAP.h5...
// Draws the belief over x and y after the first touch, and the last pose, in live_stream.svg.
#include <chrono>
#include <iostream>
#include <optional>
#include <vector>

#include <palpate/driver.hpp>
#include <palpate/palpate.hpp>

#include "drawings.hpp"

int main(int argc, char** argv) try {
  if (argc < 3) {
    std::cerr << "usage: live_stream SENSOR MAP.h5...\n";
    return 2;
  }
  const std::string name = argv[1];
  // A board does not know where it is: palpate::PosedSensor adds the robot's poses to its frames.
  const auto sensor = palpate::is_virtual_sensor(name) ? palpate::open_virtual_sensor(name)
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
    const int best = estimate.mode.object;
    const palpate::Pose pose = inverse(belief.refine(estimate.mode)).T_robot_object;
    std::cout << known[best].map.label << " with probability " << estimate.identity[best] << " at "
              << pose.translation_mm.x << ", " << pose.translation_mm.y << " mm" << std::endl;
    if (!picture) picture = picture_of(belief.marginals(best));
  }
  if (picture) {
    circle_pose(*picture, belief.lattice(), belief.refine(belief.estimate().mode).T_object_robot);
    picture->save("live_stream.svg");
  }
} catch (const palpate::Error& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
