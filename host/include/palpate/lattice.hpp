#pragma once

#include <cstdint>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// `count` bins of equal width over [lower, upper].
struct Axis {
  double lower = 0.0;
  double upper = 0.0;
  int count = 1;

  double step() const { return (upper - lower) / count; }
  double centre(int i) const { return lower + (i + 0.5) * step(); }
};

/// Regular bins over the planar pose T_object_robot. x and y are the coordinates, in the object
/// frame, of a pivot point that is given in the robot frame: p_o = R(theta) (p_r - pivot) + (x, y).
/// A pivot near the touches keeps the object in the region at every theta.
struct PALPATE_API PoseLattice {
  Axis x_mm{-10.0, 10.0, 25};
  Axis y_mm{-10.0, 10.0, 25};
  Axis theta_rad{0.0, 6.283185307179586, 16};
  glm::dvec2 pivot_mm{0.0, 0.0};

  /// Gives every axis of zero extent one bin.
  PoseLattice& collapse_fixed();
  /// @throws Error on a count below 1, a reversed range, a range of theta that exceeds_circle(), or
  /// a range or pivot that reaches beyond `farthest_mm`, for theta as many radians
  void validate() const;

  /// True where theta covers more than the full circle: poses would count twice.
  bool exceeds_circle() const;
  /// True where theta covers the full circle once: its last bin then neighbours its first.
  bool full_circle() const;
  std::int64_t plane() const { return std::int64_t{x_mm.count} * y_mm.count; }
  std::int64_t bins() const { return plane() * theta_rad.count; }
  /// The pose at the centre of a bin; index order is theta, y, x, x fastest.
  /// @throws Error where there is no such bin
  Pose T_object_robot(std::int64_t index) const;
  /// The pose at any (x, y, theta), in mm and radians.
  Pose T_object_robot(double x_mm, double y_mm, double theta_rad) const;
  /// The bin that a pose lies in, or the nearest bin where the pose is outside the region. Angles
  /// are compared modulo a full turn.
  /// @throws Error on a pose that is not finite, and as validate()
  std::int64_t bin_of(const Pose& T_object_robot) const;
};

}  // namespace palpate
