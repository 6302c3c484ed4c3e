#pragma once

#include <algorithm>
#include <numbers>

namespace palpate {

inline double degrees(double rad) { return rad * 180.0 / std::numbers::pi; }
inline double radians(double deg) { return deg * std::numbers::pi / 180.0; }

/// Whether angles that stand for radians look like degrees: they go beyond one and a half turns,
/// and either span more than a turn or go beyond two. Angles within a full turn, interpolated the
/// short way round, reach one and a half; angles that a robot counts on from turn to turn span
/// little.
inline bool seem_degrees(double least_rad, double most_rad) {
  constexpr double circle_rad = 2.0 * std::numbers::pi;
  const double largest_rad = std::max(most_rad, -least_rad);
  return largest_rad > 1.5 * circle_rad &&
         (most_rad - least_rad > circle_rad || largest_rad > 2.0 * circle_rad);
}

}  // namespace palpate
