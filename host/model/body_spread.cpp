#include "model/body_spread.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

namespace palpate {

namespace {

/// How a turn about the object frame's origin moves the centroid in the robot frame, mm per rad.
glm::dvec2 arm_mm(const Body& body, const ObjectPose& pose) {
  return rotate(pose.T_robot_object.theta_rad + std::numbers::pi / 2.0, body.centroid_mm);
}

double spin_mm(const Body& body) { return std::sqrt(std::max(body.inertia_mm2, 1e-12)); }

}  // namespace

glm::dmat3 motion_covariance(const Body& body, const ObjectPose& pose) {
  glm::dmat3 covariance{0.0};
  for (int i = 0; i < 9; ++i) {
    covariance[i % 3][i / 3] = pose.covariance[i];
  }
  glm::dmat3 motion{1.0};  // by columns
  motion[2] = {arm_mm(body, pose), spin_mm(body)};
  return motion * covariance * glm::transpose(motion);
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
