#include "press.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include "bounding_box.hpp"
#include "observed_map.hpp"
#include "palpate/error.hpp"

namespace palpate {

Press single_press(const Recording& recording, std::size_t touch) {
  Press press{fmt::format("{}, touch {}", recording.path, touch), recording.object, {}};
  press.touches.push_back(recording.touch(touch));
  press.touches.front().T_robot_sensor = {-array_centre_mm(press.touches.front().elements_mm), 0.0};
  return press;
}

Press posed_press(const Recording& recording) {
  Press press{recording.path, recording.object, recording.touches(0, recording.size())};
  BoundingBox box;
  for (const Touch& touch : press.touches) {
    for (const glm::dvec2& element : touch.elements_mm) {
      box.take_in(touch.T_robot_sensor * element);
    }
  }
  if (!box.empty()) {
    for (Touch& touch : press.touches) {
      touch.T_robot_sensor.translation_mm -= box.middle();
    }
  }
  return press;
}

std::vector<OccupancyGrid> press_maps(const std::vector<Press>& presses,
                                      const MapOptions& options) {
  std::vector<OccupancyGrid> maps(presses.size());
  tbb::parallel_for(std::size_t{0}, presses.size(), [&](std::size_t i) {
    try {
      maps[i] = observed_map(presses[i].touches, options, presses[i].label);
    } catch (const Error& error) {
      throw Error(error.fault(), fmt::format("{}: {}", presses[i].name, error.what()));
    }
  });
  return maps;
}

}  // namespace palpate
