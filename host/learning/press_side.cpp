#include "learning/press_side.hpp"

#include <cmath>

#include <glm/geometric.hpp>

namespace palpate {

PressSide::PressSide(const Touch& touch, const ContactModel& contact, bool mirrored) {
  Touch side = touch;
  if (mirrored) {
    for (const glm::dvec2& element : touch.elements_mm) {
      elements_mm_.emplace_back(-element.x, element.y);
    }
    side.elements_mm = elements_mm_;
  }
  const std::vector<Reading> readings = contact.classify(side);
  glm::dvec2 middle_mm(0.0);
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if (is_contact(readings[e])) {
      contact_mm_.push_back(side.elements_mm[e]);
      contact_pressure_.push_back(side.pressure[e]);
      middle_mm += side.elements_mm[e];
    }
  }
  const double count = contacts() > 0 ? static_cast<double>(contacts()) : 1.0;
  middle_mm /= count;
  for (const glm::dvec2& element : contact_mm_) {
    const glm::dvec2 from_middle = element - middle_mm;
    reach_mm_ += glm::dot(from_middle, from_middle) / count;
  }
  reach_mm_ = std::sqrt(reach_mm_);
  side.T_robot_sensor = {-middle_mm, 0.0};
  press_.touches = {side};
  contact_.touches = {{.T_robot_sensor = side.T_robot_sensor,
                       .elements_mm = contact_mm_,
                       .pressure = contact_pressure_}};
}

double displacement_mm(const PressSide& press, const Pose& T_object_robot, const Pose& other) {
  const glm::dvec2 d = T_object_robot.translation_mm - other.translation_mm;
  const double turned = 1.0 - std::cos(T_object_robot.theta_rad - other.theta_rad);
  return std::sqrt(glm::dot(d, d) + 2.0 * press.reach_mm() * press.reach_mm() * turned);
}

}  // namespace palpate
