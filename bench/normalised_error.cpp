#include "normalised_error.hpp"

#include <numbers>

#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "palpate/pose_error.hpp"

namespace palpate::bench {

namespace {

glm::dmat3 matrix_of(const RefinedPose& refined) {
  glm::dmat3 matrix;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      matrix[column][row] = refined.covariance[3 * row + column];
    }
  }
  return matrix;
}

/// d/d(x, y, theta) of the place of a point of the object in the robot frame, R(-theta) (p - t).
glm::dmat3x2 jacobian_of_place(const Pose& T_object_robot, const glm::dvec2& p_object_mm) {
  const double turn = -T_object_robot.theta_rad;
  const glm::dvec2 from_robot = p_object_mm - T_object_robot.translation_mm;
  return {-rotate(turn, {1.0, 0.0}), -rotate(turn, {0.0, 1.0}),
          rotate(turn, {from_robot.y, -from_robot.x})};
}

}  // namespace

double normalised_error(const OccupancyGrid& map, const RefinedPose& refined,
                        const Pose& T_object_robot_truth) {
  const Pose& estimate = refined.T_object_robot;
  const Body body = body_of(map);
  if (map.symmetry == 0) {
    const glm::dvec2 error =
        inverse(estimate) * body.centroid_mm - inverse(T_object_robot_truth) * body.centroid_mm;
    const glm::dmat3x2 jacobian = jacobian_of_place(estimate, body.centroid_mm);
    const glm::dmat2 covariance = jacobian * matrix_of(refined) * glm::transpose(jacobian);
    return expected_normalised_error / 2.0 * glm::dot(error, glm::inverse(covariance) * error);
  }
  const Pose truth = nearest_equal_pose(body, map.symmetry, estimate, T_object_robot_truth);
  const glm::dvec3 error(estimate.translation_mm - truth.translation_mm,
                         wrap_angle(estimate.theta_rad - truth.theta_rad, 2.0 * std::numbers::pi));
  return glm::dot(error, glm::inverse(matrix_of(refined)) * error);
}

}  // namespace palpate::bench
