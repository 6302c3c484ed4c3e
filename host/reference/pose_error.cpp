#include "reference.hpp"

#include <cmath>
#include <numbers>

namespace palpate::reference {

namespace {

glm::dvec2 robot_from_object(const Pose& T_object_robot, const glm::dvec2& p_object) {
  const double dx = p_object.x - T_object_robot.translation_mm.x;
  const double dy = p_object.y - T_object_robot.translation_mm.y;
  const double c = std::cos(T_object_robot.theta_rad);
  const double s = std::sin(T_object_robot.theta_rad);
  return {c * dx + s * dy, -s * dx + c * dy};
}

}  // namespace

double pose_error_mm(const OccupancyGrid& map, const Pose& T_object_robot_estimate,
                     const Pose& T_object_robot_truth) {
  std::vector<glm::dvec2> body;
  glm::dvec2 centroid{0.0, 0.0};
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (map.at(i, j) > 0.0F) {
        body.emplace_back(map.origin_mm.x + map.cell_mm * i, map.origin_mm.y + map.cell_mm * j);
        centroid += body.back();
      }
    }
  }
  const auto cells = static_cast<double>(body.size());
  centroid /= cells;
  double J = 0.0;
  for (const glm::dvec2& p : body) {
    J += (std::pow(p.x - centroid.x, 2) + std::pow(p.y - centroid.y, 2)) / cells;
  }
  const glm::dvec2 shift = robot_from_object(T_object_robot_estimate, centroid) -
                           robot_from_object(T_object_robot_truth, centroid);
  double turn = 0.0;
  if (map.symmetry > 0) {
    const double period = 2.0 * std::numbers::pi / map.symmetry;
    turn =
        std::remainder(T_object_robot_estimate.theta_rad - T_object_robot_truth.theta_rad, period);
  }
  return std::sqrt(shift.x * shift.x + shift.y * shift.y + 2.0 * J * (1.0 - std::cos(turn)));
}

}  // namespace palpate::reference
