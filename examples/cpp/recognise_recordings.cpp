// Recognises the object of each recording among known maps, and finds its pose.
//   recognise_recordings RECORDING.h5... --maps MAP.h5...
// Draws the touches on the map of the object, in RECORDING.h5.svg.
#include <iostream>
#include <string>
#include <vector>

#include <palpate/palpate.hpp>

#include "drawings.hpp"

int main(int argc, char** argv) try {
  std::vector<std::string> recordings;
  std::vector<palpate::Hypothesis> known;
  bool maps = false;
  for (const std::string& argument : std::vector<std::string>(argv + 1, argv + argc)) {
    if (argument == "--maps") {
      maps = true;
    } else if (maps) {
      known.push_back({.map = palpate::read_map(argument)});
    } else {
      recordings.push_back(argument);
    }
  }
  if (recordings.empty() || known.empty()) {
    std::cerr << "usage: recognise_recordings RECORDING.h5... --maps MAP.h5...\n";
    return 2;
  }

  palpate::Device device = palpate::Device::open();
  for (const std::string& path : recordings) {
    const palpate::Recording recording = palpate::read_recording(path);
    const std::vector<palpate::Touch> touches = recording.touches(0, recording.size());

    // All poses at which the first touch may meet an object, in bins as fine as the maps.
    const palpate::Touch& first = touches.front();
    palpate::PoseLattice region =
        palpate::touch_region(known, palpate::array_reach_mm(first.elements_mm)).lattice;
    region.pivot_mm = first.T_robot_sensor * palpate::array_centre_mm(first.elements_mm);
    palpate::PoseHistogram belief(device, known,
                                  {.lattice = palpate::balanced_lattice(region, known).lattice});
    belief.update(touches);

    const palpate::Estimate estimate = belief.estimate();
    const int best = estimate.mode.object;
    const palpate::RefinedPose refined = belief.refine(estimate.mode);
    const palpate::ObjectPose pose = inverse(refined);
    const auto sd = pose.sd();
    std::cout << path << ": " << known[best].map.label << " with probability "
              << estimate.identity[best] << " at x = " << pose.T_robot_object.translation_mm.x
              << " +- " << sd[0] << " mm, y = " << pose.T_robot_object.translation_mm.y << " +- "
              << sd[1] << " mm, theta = " << pose.T_robot_object.theta_rad << " +- " << sd[2]
              << " rad\n";
    draw_touches(touches, known[best].map, refined.T_object_robot, path + ".svg");
  }
} catch (const palpate::Error& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
