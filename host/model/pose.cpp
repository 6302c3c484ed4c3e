#include "palpate/pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

#include "model/body_spread.hpp"
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
  if (body && symmetry == 0) {
    // The turn follows theta, so that theta moves the body alone: of T_robot_object, whose theta
    // keeps its variance, x and y do not depend on where the frame's origin lies.
    const glm::dvec2 arm_mm = refined.T_object_robot.translation_mm - body->centroid_mm;
    jacobian[2] = {rotate(std::numbers::pi / 2.0, turned.translation_mm - rotate(turn_rad, arm_mm)),
                   1.0};
  }
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
