#pragma once

#include <array>

#include <glm/mat3x3.hpp>

#include "palpate/estimate.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

/// Root mean square distance of a body from its centroid, mm: how far a turn by 1 rad moves it.
double spin_mm(const Body& body);

/// The covariance of what depends so on (x, y, theta), row by row, to first order.
/// @param jacobian by columns
std::array<double, 9> carried_over(const glm::dmat3& covariance, const glm::dmat3& jacobian);

/// The covariance of how far the pose's deviations move the body, in mm^2: the shift of its
/// centroid along x and y, and its turn, as the root mean square displacement about the centroid.
glm::dmat3 motion_covariance(const Body& body, const ObjectPose& pose);
/// Root mean square displacement of the body by the pose's deviations, mm.
double spread_mm(const Body& body, const ObjectPose& pose);

/// The pose with the covariance that the scale makes of it.
ObjectPose scaled(const Body& body, ObjectPose pose, const PoseScale& scale);

}  // namespace palpate
