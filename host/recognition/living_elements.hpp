#pragma once

#include <cstddef>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact_model.hpp"
#include "palpate/pose.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The living elements of one touch, and what they read.
struct LivingElements {
  struct Element {
    glm::dvec2 p_sensor_mm;
    std::size_t reading = 0;  ///< class of ReadingModel
  };

  LivingElements(const Touch& touch, const ContactModel& contact);

  Pose T_robot_sensor;
  std::vector<Element> elements;
};

}  // namespace palpate
