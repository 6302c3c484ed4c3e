#include "palpate/pose.hpp"

#include <cmath>

namespace palpate {

glm::dvec2 rotate(double theta_rad, const glm::dvec2& v) {
  const double c = std::cos(theta_rad);
  const double s = std::sin(theta_rad);
  return {c * v.x - s * v.y, s * v.x + c * v.y};
}

Pose operator*(const Pose& T_a_b, const Pose& T_b_c) {
  return {T_a_b * T_b_c.translation_mm, T_a_b.theta_rad + T_b_c.theta_rad};
}

glm::dvec2 operator*(const Pose& T_a_b, const glm::dvec2& p_b) {
  return rotate(T_a_b.theta_rad, p_b) + T_a_b.translation_mm;
}

Pose inverse(const Pose& T_a_b) {
  return {-rotate(-T_a_b.theta_rad, T_a_b.translation_mm), -T_a_b.theta_rad};
}

double wrap_angle(double theta_rad, double period_rad) {
  const double wrapped = theta_rad - period_rad * std::floor(theta_rad / period_rad + 0.5);
  // Rounding can land on the excluded end.
  return wrapped >= period_rad / 2 ? wrapped - period_rad : wrapped;
}

}  // namespace palpate
