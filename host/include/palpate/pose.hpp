#pragma once

#include <numbers>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"

namespace palpate {

/// Largest |x| and |y| of a map or a lattice, in mm: 1,000 km, where float64 still resolves 1e-7 mm
/// and squares are far from infinite.
inline constexpr double farthest_mm = 1e9;

/// A rigid transformation of the plane. Written T_a_b it maps coordinates in frame b to frame a:
/// p_a = R(theta_rad) p_b + translation_mm.
struct Pose {
  glm::dvec2 translation_mm{0.0, 0.0};
  double theta_rad = 0.0;  ///< counter-clockwise, of any number of turns
};

/// T_a_c = T_a_b * T_b_c. Angles add; they are not wrapped.
PALPATE_API Pose operator*(const Pose& T_a_b, const Pose& T_b_c);

/// p_a = T_a_b * p_b, in mm.
PALPATE_API glm::dvec2 operator*(const Pose& T_a_b, const glm::dvec2& p_b);

/// T_b_a from T_a_b.
PALPATE_API Pose inverse(const Pose& T_a_b);

/// R(theta) v: rotates v counter-clockwise.
PALPATE_API glm::dvec2 rotate(double theta_rad, const glm::dvec2& v);

/// Returns the angle plus a whole number of periods, in [-period/2, period/2).
PALPATE_API double wrap_angle(double theta_rad, double period_rad = 2.0 * std::numbers::pi);

/// Standard deviations of a small displacement in the plane: of x and of y, in mm, and of the
/// angle, in radians. All three are independent and normally distributed about 0.
struct DisplacementSd {
  double mm = 0.0;
  double rad = 0.0;

  /// True where nothing is ever displaced.
  bool none() const { return mm == 0.0 && rad == 0.0; }
};

}  // namespace palpate
