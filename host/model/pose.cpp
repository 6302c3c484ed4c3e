#include "palpate/pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "model/body_spread.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_error.hpp"

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

Body body_of(const OccupancyGrid& map) {
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
    throw Error(Fault::input,
                fmt::format("map '{}': no cell has log odds above 0, so no pose error can be "
                            "measured; map touches that meet the object",
                            map.label));
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

namespace {

glm::dmat3 matrix_of(const std::array<double, 9>& rows) {
  glm::dmat3 columns{0.0};
  for (int i = 0; i < 9; ++i) {
    columns[i % 3][i / 3] = rows[i];
  }
  return columns;
}

/// How a turn about the object frame's origin moves the centroid in the robot frame, mm per rad.
glm::dvec2 arm_mm(const Body& body, const ObjectPose& pose) {
  return rotate(pose.T_robot_object.theta_rad + std::numbers::pi / 2.0, body.centroid_mm);
}

}  // namespace

double spin_mm(const Body& body) { return std::sqrt(std::max(body.inertia_mm2, 1e-12)); }

std::array<double, 9> carried_over(const glm::dmat3& covariance, const glm::dmat3& jacobian) {
  const glm::dmat3 carried = jacobian * covariance * glm::transpose(jacobian);
  std::array<double, 9> result{};
  for (int i = 0; i < 9; ++i) {
    // Rounding must not leave it unsymmetric.
    result[i] = (carried[i % 3][i / 3] + carried[i / 3][i % 3]) / 2.0;
  }
  return result;
}

std::array<double, 3> ObjectPose::sd() const {
  // Rounding may leave a variance of nothing below zero.
  return {std::sqrt(std::max(covariance[0], 0.0)), std::sqrt(std::max(covariance[4], 0.0)),
          std::sqrt(std::max(covariance[8], 0.0))};
}

ObjectPose inverse(const RefinedPose& refined) {
  const double theta_rad = refined.T_object_robot.theta_rad;
  const Pose T_robot_object = inverse(refined.T_object_robot);
  // t' = -R(-theta) t and theta' = -theta, so dt' = -R(-theta) dt + R(pi/2 - theta) t dtheta, whose
  // last term is -R(pi/2) t' dtheta.
  const glm::dvec2 slope = -rotate(std::numbers::pi / 2.0, T_robot_object.translation_mm);
  glm::dmat3 jacobian{0.0};  // by columns
  jacobian[0] = {-rotate(-theta_rad, {1.0, 0.0}), 0.0};
  jacobian[1] = {-rotate(-theta_rad, {0.0, 1.0}), 0.0};
  jacobian[2] = {slope, -1.0};
  return {T_robot_object, carried_over(matrix_of(refined.covariance), jacobian)};
}

RefinedPose least_turned(const std::optional<Body>& body, int symmetry,
                         const RefinedPose& refined) {
  const Pose turned = least_turned(body, symmetry, refined.T_object_robot);
  const double turn_rad = turned.theta_rad - refined.T_object_robot.theta_rad;
  glm::dmat3 jacobian{1.0};  // by columns
  jacobian[0] = {rotate(turn_rad, {1.0, 0.0}), 0.0};
  jacobian[1] = {rotate(turn_rad, {0.0, 1.0}), 0.0};
  return {turned, carried_over(matrix_of(refined.covariance), jacobian)};
}

glm::dmat3 motion_covariance(const Body& body, const ObjectPose& pose) {
  glm::dmat3 motion{1.0};  // by columns
  motion[2] = {arm_mm(body, pose), spin_mm(body)};
  return motion * matrix_of(pose.covariance) * glm::transpose(motion);
}

double spread_mm(const Body& body, const ObjectPose& pose) {
  const glm::dmat3 covariance = motion_covariance(body, pose);
  return std::sqrt(std::max(0.0, covariance[0][0] + covariance[1][1] + covariance[2][2]));
}

ObjectPose scaled(const Body& body, ObjectPose pose, const PoseScale& scale) {
  const double sd_mm = scale.map_sd_mm;
  const double turn_rad = sd_mm / spin_mm(body);
  // The centroid rests, so the frame's origin moves.
  const glm::dvec3 turn(-turn_rad * arm_mm(body, pose), turn_rad);
  for (int i = 0; i < 9; ++i) {
    pose.covariance[i] = scale.factor * pose.covariance[i] + turn[i / 3] * turn[i % 3] +
                         (i == 0 || i == 4 ? sd_mm * sd_mm : 0.0);
  }
  return pose;
}

}  // namespace palpate
