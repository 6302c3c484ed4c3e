#include "model/displacement_points.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate {

double normal_quantile(double probability) {
  // Abramowitz and Stegun 26.2.23, within 4.5e-4, then Newton's method.
  const double tail = std::min(probability, 1.0 - probability);
  const double t = std::sqrt(-2.0 * std::log(tail));
  double x = t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                     (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
  for (int step = 0; step < 3; ++step) {
    const double beyond = 0.5 * std::erfc(x / std::numbers::sqrt2);
    const double density = std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
    x += (beyond - tail) / density;
  }
  return probability < 0.5 ? -x : x;
}

std::vector<Pose> displacement_points(const DisplacementSd& sd, std::size_t count) {
  if (sd.none()) {
    return {Pose{}};
  }
  constexpr double golden = 1.2207440846057596;  // the root of g^4 = g + 1
  const auto point = [](std::size_t i, double power) {
    const double place = 0.5 + static_cast<double>(i) * std::pow(golden, -power);
    return normal_quantile(place - std::floor(place));
  };
  std::vector<Pose> points;
  points.reserve(count);
  for (std::size_t i = 1; i <= count; ++i) {
    points.push_back({{sd.mm * point(i, 1.0), sd.mm * point(i, 2.0)}, sd.rad * point(i, 3.0)});
  }
  return points;
}

Pose random_displacement(const DisplacementSd& sd, Random& random) {
  const double x = sd.mm * random.normal();
  const double y = sd.mm * random.normal();
  return {{x, y}, sd.rad * random.normal()};
}

Pose slipped(const Pose& T_object_robot, const Pose& slip, const glm::dvec2& centroid_mm) {
  const Pose moved{centroid_mm - rotate(slip.theta_rad, centroid_mm) + slip.translation_mm,
                   slip.theta_rad};
  return moved * T_object_robot;
}

}  // namespace palpate
