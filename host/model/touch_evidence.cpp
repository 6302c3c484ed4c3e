#include "model/touch_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/contact_readings.hpp"

namespace palpate {

namespace {

bool is_known(Reading reading) { return reading != Reading::unknown; }

/// The evidence of the elements whose reading is `kept`.
template <typename Kept>
TouchEvidence evidence_where(TouchEvidence evidence, const Kept& kept) {
  std::size_t n = 0;
  for (std::size_t e = 0; e < evidence.readings.size(); ++e) {
    if (kept(evidence.readings[e])) {
      evidence.elements_mm[n] = evidence.elements_mm[e];
      evidence.readings[n] = evidence.readings[e];
      evidence.lives[n++] = evidence.lives[e];
    }
  }
  evidence.elements_mm.resize(n);
  evidence.readings.resize(n);
  evidence.lives.resize(n);
  return evidence;
}

}  // namespace

void TouchEvidence::assign(const Touch& touch, const ContactModel& contact) {
  readings = classify(touch, contact, std::move(readings));
  T_robot_sensor = touch.T_robot_sensor;
  elements_mm.assign(touch.elements_mm.begin(), touch.elements_mm.end());
  lives.assign(readings.size(), 0);
  contacts = static_cast<std::size_t>(std::ranges::count_if(readings, is_contact));
  least_pressure = std::numeric_limits<double>::infinity();
  largest_pressure = -least_pressure;
  force = 0.0;
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if (!is_living(touch, e)) {
      continue;
    }
    const double pressure = touch.pressure[e];
    lives[e] = 1;
    least_pressure = std::min(least_pressure, pressure);
    largest_pressure = std::max(largest_pressure, pressure);
    force += pressure > 0.0 ? pressure / contact.classifier.threshold : 0.0;
  }
}

bool TouchEvidence::tells() const { return std::ranges::any_of(readings, is_known); }

TouchEvidence TouchEvidence::known() const { return evidence_where(*this, is_known); }

TouchEvidence TouchEvidence::contact() const { return evidence_where(*this, is_contact); }

bool is_living(const Touch& touch, std::size_t element) {
  return (touch.valid.empty() || touch.valid[element] != 0) && !std::isnan(touch.pressure[element]);
}

std::vector<TouchEvidence> evidence_of(std::span<const Touch> touches,
                                       const ContactModel& contact) {
  std::vector<TouchEvidence> evidence;
  evidence_of(touches, contact, evidence);
  return evidence;
}

std::span<const TouchEvidence> evidence_of(std::span<const Touch> touches,
                                           const ContactModel& contact,
                                           std::vector<TouchEvidence>& room, std::size_t first) {
  room.resize(std::max(room.size(), first + touches.size()));
  for (std::size_t i = 0; i < touches.size(); ++i) {
    room[first + i].assign(touches[i], contact);
  }
  return std::span(room).subspan(first, touches.size());
}

}  // namespace palpate
