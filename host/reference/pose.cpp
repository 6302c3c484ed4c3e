#include "reference/reference.hpp"

#include <cmath>
#include <numbers>

namespace palpate::reference {

glm::dvec2 transform(const Pose& T_a_b, const glm::dvec2& p_b) {
  const double c = std::cos(T_a_b.theta_rad);
  const double s = std::sin(T_a_b.theta_rad);
  return {c * p_b.x - s * p_b.y + T_a_b.translation_mm.x,
          s * p_b.x + c * p_b.y + T_a_b.translation_mm.y};
}

namespace {

/// p_b = R(-theta) (p_a - t), in mm.
glm::dvec2 transform_back(const Pose& T_a_b, const glm::dvec2& p_a) {
  const double dx = p_a.x - T_a_b.translation_mm.x;
  const double dy = p_a.y - T_a_b.translation_mm.y;
  const double c = std::cos(T_a_b.theta_rad);
  const double s = std::sin(T_a_b.theta_rad);
  return {c * dx + s * dy, -s * dx + c * dy};
}

}  // namespace

Body body_of(const OccupancyGrid& map) {
  std::vector<glm::dvec2> cells;
  Body body;
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (map.at(i, j) > 0.0F) {
        cells.emplace_back(map.origin_mm.x + map.cell_mm * i, map.origin_mm.y + map.cell_mm * j);
        body.centroid_mm += cells.back();
      }
    }
  }
  const auto count = static_cast<double>(cells.size());
  body.centroid_mm /= count;
  for (const glm::dvec2& p : cells) {
    body.inertia_mm2 +=
        (std::pow(p.x - body.centroid_mm.x, 2) + std::pow(p.y - body.centroid_mm.y, 2)) / count;
  }
  return body;
}

double pose_error_mm(const OccupancyGrid& map, const Pose& T_object_robot_estimate,
                     const Pose& T_object_robot_truth) {
  const auto [centroid, J] = reference::body_of(map);
  const glm::dvec2 shift = transform_back(T_object_robot_estimate, centroid) -
                           transform_back(T_object_robot_truth, centroid);
  double turn = 0.0;
  if (map.symmetry > 0) {
    const double period = 2.0 * std::numbers::pi / map.symmetry;
    turn =
        std::remainder(T_object_robot_estimate.theta_rad - T_object_robot_truth.theta_rad, period);
  }
  // Eq. 17-20.
  return std::sqrt(shift.x * shift.x + shift.y * shift.y + 2.0 * J * (1.0 - std::cos(turn)));
}

}  // namespace palpate::reference
