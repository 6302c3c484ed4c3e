#pragma once

#include <cstdint>

#include <glm/vec2.hpp>

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

/// Regular bins over the planar pose T_object_robot. x and y are the object-frame coordinates of a
/// pivot point given in the robot frame, p_o = R(theta) (p_r - pivot) + (x, y), so that a rotation
/// does not fling the object about a far robot origin.
struct PoseLattice {
  Axis x_mm{-10.0, 10.0, 25};
  Axis y_mm{-10.0, 10.0, 25};
  Axis theta_rad{0.0, 6.283185307179586, 16};
  glm::dvec2 pivot_mm{0.0, 0.0};

  /// A dimension of zero extent costs one bin, whatever count was asked for.
  PoseLattice& collapse_fixed();
  /// Throws Error on counts below one, on reversed ranges, and on ends or a pivot beyond
  /// `farthest_mm`, or as many radians, where float64 still tells 1e-7 apart.
  void validate() const;

  /// theta covers the whole circle once, so that its last bin neighbours its first.
  bool full_circle() const;
  std::int64_t plane() const { return std::int64_t{x_mm.count} * y_mm.count; }
  std::int64_t bins() const { return plane() * theta_rad.count; }
  /// The pose of a bin; index order is theta, y, x, x fastest.
  Pose T_object_robot(std::int64_t index) const;
  /// The pose at any (x, y, theta), in mm and radians.
  Pose T_object_robot(double x_mm, double y_mm, double theta_rad) const;
  /// The bin that a pose lies in, or the nearest bin where the pose is outside the region. Angles
  /// are compared modulo a full turn.
  /// @throws Error on a pose that is not finite
  std::int64_t bin_of(const Pose& T_object_robot) const;
};

}  // namespace palpate
