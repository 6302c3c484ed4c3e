#include "recognition/living_elements.hpp"

#include "model/predicted_readings.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

LivingElements::LivingElements(const Touch& touch, const ContactModel& contact)
    : T_robot_sensor(touch.T_robot_sensor) {
  const TouchEvidence evidence(touch, contact);
  const std::vector<Reading>& readings = evidence.readings;
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if (evidence.lives[e] != 0) {
      elements.push_back({touch.elements_mm[e], readings[e] == Reading::unknown
                                                    ? reading_levels(contact)
                                                    : static_cast<std::size_t>(readings[e])});
    }
  }
}

}  // namespace palpate
