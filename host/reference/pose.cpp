#include "reference/reference.hpp"

#include <cmath>

namespace palpate::reference {

glm::dvec2 transform(const Pose& T_a_b, const glm::dvec2& p_b) {
  const double c = std::cos(T_a_b.theta_rad);
  const double s = std::sin(T_a_b.theta_rad);
  return {c * p_b.x - s * p_b.y + T_a_b.translation_mm.x,
          s * p_b.x + c * p_b.y + T_a_b.translation_mm.y};
}

glm::dvec2 transform_back(const Pose& T_a_b, const glm::dvec2& p_a) {
  const double dx = p_a.x - T_a_b.translation_mm.x;
  const double dy = p_a.y - T_a_b.translation_mm.y;
  const double c = std::cos(T_a_b.theta_rad);
  const double s = std::sin(T_a_b.theta_rad);
  return {c * dx + s * dy, -s * dx + c * dy};
}

}  // namespace palpate::reference
