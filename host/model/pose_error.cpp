#include "palpate/pose_error.hpp"

#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "model/refuse.hpp"

namespace palpate {

Body body_of(const OccupancyGrid& map) {
  require_sound_map(map);
  glm::dvec2 sum{0.0};
  std::int64_t cells = 0;
  const auto for_each_occupied = [&map](const auto& visit) {
    for (int j = 0; j < map.ny; ++j) {
      for (int i = 0; i < map.nx; ++i) {
        if (map.at(i, j) > 0.0F) {
          visit(map.centre_mm(i, j));
        }
      }
    }
  };
  for_each_occupied([&](const glm::dvec2& p) {
    sum += p;
    ++cells;
  });
  if (cells == 0) {
    refuse(fmt::format("map '{}'", map.label),
           "no cell has log odds above 0, so no pose error can be measured; map touches that meet "
           "the object");
  }
  Body body{.centroid_mm = sum / static_cast<double>(cells)};
  // A second pass about the centroid does not cancel when the object is far from the origin.
  for_each_occupied([&](const glm::dvec2& p) {
    const glm::dvec2 d = p - body.centroid_mm;
    body.inertia_mm2 += glm::dot(d, d);
  });
  body.inertia_mm2 /= static_cast<double>(cells);
  return body;
}

Pose nearest_equal_pose(const Body& body, int symmetry, const Pose& T_object_robot_estimate,
                        const Pose& T_object_robot_truth) {
  double turn_rad = T_object_robot_estimate.theta_rad - T_object_robot_truth.theta_rad;
  if (symmetry > 0) {
    turn_rad -= wrap_angle(turn_rad, 2.0 * std::numbers::pi / symmetry);
  }
  return Pose{body.centroid_mm - rotate(turn_rad, body.centroid_mm), turn_rad} *
         T_object_robot_truth;
}

double pose_error_mm(const Body& body, int symmetry, const Pose& T_object_robot_estimate,
                     const Pose& T_object_robot_truth) {
  const glm::dvec2 shift = inverse(T_object_robot_estimate) * body.centroid_mm -
                           inverse(T_object_robot_truth) * body.centroid_mm;
  double turn_rad = 0.0;
  if (symmetry > 0) {
    turn_rad = wrap_angle(T_object_robot_estimate.theta_rad - T_object_robot_truth.theta_rad,
                          2.0 * std::numbers::pi / symmetry);
  }
  // 1 - cos(a) = 2 sin^2(a / 2), without cancellation at small angles.
  const double s = std::sin(turn_rad / 2.0);
  // Where the truth is absurdly far away, squares would be infinite.
  return std::hypot(shift.x, shift.y, 2.0 * std::sqrt(body.inertia_mm2) * s);
}

Pose least_turned(const std::optional<Body>& body, int symmetry, const Pose& T_object_robot) {
  if (!body || symmetry == 1) {
    return T_object_robot;
  }
  const double period_rad = 2.0 * std::numbers::pi / symmetry;
  const double theta_rad = symmetry == 0 ? 0.0 : wrap_angle(-T_object_robot.theta_rad, period_rad);
  const double turn_rad = -theta_rad - T_object_robot.theta_rad;
  return Pose{body->centroid_mm - rotate(turn_rad, body->centroid_mm), turn_rad} * T_object_robot;
}

}  // namespace palpate
