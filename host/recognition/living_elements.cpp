#include "recognition/living_elements.hpp"

#include <cmath>

#include "model/predicted_readings.hpp"

namespace palpate {

LivingElements::LivingElements(const Touch& touch, const ContactModel& contact)
    : T_robot_sensor(touch.T_robot_sensor) {
  const std::vector<Reading> readings = contact.classify(touch);
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if ((touch.valid.empty() || touch.valid[e] != 0) && !std::isnan(touch.pressure[e])) {
      elements.push_back({touch.elements_mm[e], readings[e] == Reading::unknown
                                                    ? reading_levels(contact)
                                                    : static_cast<std::size_t>(readings[e])});
    }
  }
}

}  // namespace palpate
