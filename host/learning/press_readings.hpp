#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec2.hpp>

#include "bounding_box.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// Elements of a row of the array, one step apart, that read alike.
struct ReadingRun {
  std::size_t level = 0;  ///< Reading as a number
  int x = 0;              ///< of the first element, in steps from PressReadings::first_mm
  int y = 0;
  int length = 0;
};

/// The known elements of a press, in the sensor frame; where the press is mirrored, x to -x.
struct PressReadings {
  /// @param step_mm the lattice on which `runs` stand; each element counts at the nearest node
  PressReadings(const Touch& touch, const ContactModel& contact, bool mirrored, double step_mm);

  std::vector<glm::dvec2> elements_mm;  ///< [e]
  std::vector<std::uint8_t> levels;     ///< [e] Reading as a number
  glm::dvec2 first_mm{0.0};             ///< place of node (0, 0), the first known element
  std::vector<ReadingRun> runs;
  BoundingBox nodes;          ///< around the elements' nodes, in steps from first_mm
  std::size_t contacts = 0;   ///< elements In Contact
  BoundingBox contact_box;    ///< around them, in mm; empty without any
  glm::dvec2 centre_mm{0.0};  ///< their mean
  double reach_mm = 0.0;      ///< their root mean squared distance from the mean
};

/// The root mean squared displacement in mm of a press's contact between two poses.
double displacement_mm(const PressReadings& press, const Pose& T_object_sensor, const Pose& other);

}  // namespace palpate
