#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

#include "learning/press.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// A press on one of the object's sides: as it is, or mirrored, x to -x in the sensor frame. Its
/// robot frame has the origin in the middle of its contact, and the sensor's axes. A view into the
/// touch, as far as nothing is mirrored.
class PressSide {
 public:
  PressSide(const Touch& touch, const ContactModel& contact, bool mirrored);
  PressSide(PressSide&&) = default;
  PressSide& operator=(PressSide&&) = default;

  const Touch& touch() const { return press_.touches.front(); }
  const Press& press() const { return press_; }
  /// Its elements In Contact alone.
  const Press& contact() const { return contact_; }
  std::size_t contacts() const { return contact_mm_.size(); }
  /// The contact's root mean squared distance from its middle.
  double reach_mm() const { return reach_mm_; }

 private:
  std::vector<glm::dvec2> elements_mm_;  ///< where the press is mirrored
  std::vector<glm::dvec2> contact_mm_;
  std::vector<double> contact_pressure_;
  Press press_;
  Press contact_;
  double reach_mm_ = 0.0;
};

/// The root mean squared displacement in mm of a press's contact between two poses.
double displacement_mm(const PressSide& press, const Pose& T_object_robot, const Pose& other);

}  // namespace palpate
