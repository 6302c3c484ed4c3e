#pragma once

#include <numbers>

namespace palpate {

/// Whether angles that stand for radians look like degrees: they go beyond a full turn by more than
/// 45 degrees, and either span more than one and a half turns or go beyond two. Angles that a robot
/// counts on over a full turn, or that are interpolated across one, look like radians.
inline bool seem_degrees(double least_rad, double most_rad) {
  constexpr double circle_rad = 2.0 * std::numbers::pi;
  constexpr double margin_rad = circle_rad / 8.0;
  const double largest = most_rad > -least_rad ? most_rad : -least_rad;
  return largest > circle_rad + margin_rad &&
         (largest > 2.0 * circle_rad || most_rad - least_rad > 1.5 * circle_rad);
}

}  // namespace palpate
