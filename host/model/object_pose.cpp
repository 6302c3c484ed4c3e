#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "palpate/estimate.hpp"

namespace palpate {

std::array<double, 3> ObjectPose::sd() const {
  // Rounding may leave a variance of nothing below zero.
  return {std::sqrt(std::max(covariance[0], 0.0)), std::sqrt(std::max(covariance[4], 0.0)),
          std::sqrt(std::max(covariance[8], 0.0))};
}

ObjectPose inverse(const RefinedPose& refined) {
  const double theta_rad = refined.T_object_robot.theta_rad;
  ObjectPose result{.T_robot_object = inverse(refined.T_object_robot)};
  // t' = -R(-theta) t and theta' = -theta, so dt' = -R(-theta) dt + R(pi/2 - theta) t dtheta, whose
  // last term is -R(pi/2) t' dtheta.
  const glm::dvec2 slope = -rotate(std::numbers::pi / 2.0, result.T_robot_object.translation_mm);
  glm::dmat3 jacobian{0.0};  // by columns
  jacobian[0] = {-rotate(-theta_rad, {1.0, 0.0}), 0.0};
  jacobian[1] = {-rotate(-theta_rad, {0.0, 1.0}), 0.0};
  jacobian[2] = {slope, -1.0};
  glm::dmat3 covariance{0.0};
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      covariance[column][row] = refined.covariance[3 * row + column];
    }
  }
  const glm::dmat3 carried = jacobian * covariance * glm::transpose(jacobian);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      // Rounding must not leave it unsymmetric.
      result.covariance[3 * row + column] = (carried[column][row] + carried[row][column]) / 2.0;
    }
  }
  return result;
}

}  // namespace palpate
