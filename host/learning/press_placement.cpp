#include "press_placement.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bounding_box.hpp"

namespace palpate {

PressPlacer::PressPlacer(Device& device, const Hypothesis& hypothesis, const ContactModel& contact,
                         const PoseLattice& lattice)
    : posterior_(device, std::span(&hypothesis, 1),
                 {.lattice = lattice, .contact = contact, .tolerance = placement_tolerance}) {}

PressPlacement PressPlacer::place(const Press& press) {
  posterior_.reset();
  posterior_.update(press.touches);
  const Estimate estimate = posterior_.estimate();
  const LogInterval evidence = estimate.certificate->log_evidence.front();
  const double bins = static_cast<double>(posterior_.lattice().bins());
  return {.T_object_robot = estimate.mode.T_object_robot,
          .log_likelihood = estimate.mode.log_likelihood,
          .log_evidence = (evidence.low + evidence.high) / 2.0 - std::log(bins)};
}

PoseLattice placing_lattice(std::span<const Press> presses, double step_mm, double step_rad) {
  glm::dvec2 half_mm(0.0);
  for (const Press& press : presses) {
    BoundingBox box;
    for (const Touch& touch : press.touches) {
      for (const glm::dvec2& element : touch.elements_mm) {
        box.take_in(touch.T_robot_sensor * element);
      }
    }
    if (!box.empty()) {
      half_mm = glm::max(half_mm, box.extent() / 2.0);
    }
  }
  const auto axis = [](double half, double step) {
    return Axis{-half, half, std::max(1, static_cast<int>(std::ceil(2.0 * half / step - 1e-9)))};
  };
  Axis theta = axis(std::numbers::pi, step_rad);
  theta.lower = 0.0;
  theta.upper = 2.0 * std::numbers::pi;
  return {.x_mm = axis(half_mm.x, step_mm), .y_mm = axis(half_mm.y, step_mm), .theta_rad = theta};
}

}  // namespace palpate
