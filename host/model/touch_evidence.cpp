#include "model/touch_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

TouchEvidence::TouchEvidence(const Touch& touch, const ContactModel& contact)
    : T_robot_sensor(touch.T_robot_sensor),
      elements_mm(touch.elements_mm.begin(), touch.elements_mm.end()),
      readings(contact.classify(touch)),
      lives(readings.size()),
      contacts(static_cast<std::size_t>(std::ranges::count_if(readings, is_contact))) {
  for (std::size_t e = 0; e < readings.size(); ++e) {
    const double pressure = touch.pressure[e];
    if ((!touch.valid.empty() && touch.valid[e] == 0) || std::isnan(pressure)) {
      continue;
    }
    lives[e] = 1;
    least_pressure = std::min(least_pressure, pressure);
    largest_pressure = std::max(largest_pressure, pressure);
    force += pressure > 0.0 ? pressure / contact.classifier.threshold : 0.0;
  }
}

TouchEvidence TouchEvidence::known() const {
  TouchEvidence evidence = *this;
  std::size_t n = 0;
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if (readings[e] != Reading::unknown) {
      evidence.elements_mm[n] = elements_mm[e];
      evidence.readings[n] = readings[e];
      evidence.lives[n++] = lives[e];
    }
  }
  evidence.elements_mm.resize(n);
  evidence.readings.resize(n);
  evidence.lives.resize(n);
  return evidence;
}

std::vector<TouchEvidence> evidence_of(std::span<const Touch> touches,
                                       const ContactModel& contact) {
  std::vector<TouchEvidence> evidence;
  evidence.reserve(touches.size());
  for (const Touch& touch : touches) {
    evidence.emplace_back(touch, contact);
  }
  return evidence;
}

}  // namespace palpate
