#include "learning/press.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "model/bounding_box.hpp"

namespace palpate {

bool has_poses(const Recording& recording) {
  for (const Pose& pose : recording.T_robot_sensor) {
    const Pose& first = recording.T_robot_sensor.front();
    if (pose.translation_mm != first.translation_mm || pose.theta_rad != first.theta_rad) {
      return true;
    }
  }
  return false;
}

Press single_press(const Recording& recording, std::size_t touch) {
  Press press{fmt::format("{}, touch {}", recording.path, touch), recording.object, {}};
  press.touches.push_back(recording.touch(touch));
  press.touches.front().T_robot_sensor = {-array_centre_mm(press.touches.front().elements_mm), 0.0};
  return press;
}

Press posed_press(const Recording& recording, std::size_t touch) {
  Press press = single_press(recording, touch);
  press.T_object_robot =
      recording.touch(touch).T_robot_sensor * inverse(press.touches.front().T_robot_sensor);
  return press;
}

std::vector<std::size_t> folds_of(const std::vector<Press>& presses, std::size_t folds) {
  std::map<std::string, std::size_t> of_label;
  for (const Press& press : presses) {
    ++of_label[press.label];
  }
  std::map<std::string, std::size_t> counted;
  std::vector<std::size_t> fold;
  for (const Press& press : presses) {
    const std::size_t k = counted[press.label]++;
    fold.push_back(press.T_object_robot ? k % folds : k * folds / of_label.at(press.label));
  }
  return fold;
}

std::vector<double> contact_pressures(const std::vector<Press>& presses,
                                      const ContactClassifier& classifier) {
  std::vector<double> pressures;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      const std::vector<Reading> readings = classifier.classify(touch);
      for (std::size_t e = 0; e < readings.size(); ++e) {
        if (is_contact(readings[e])) {
          pressures.push_back(touch.pressure[e]);
        }
      }
    }
  }
  std::ranges::sort(pressures);
  return pressures;
}

}  // namespace palpate
