#pragma once

#include <glm/mat3x3.hpp>

#include "palpate/estimate.hpp"
#include "palpate/pose_error.hpp"

namespace palpate {

/// The covariance of how far the pose's deviations move the body, in mm^2: the shift of its centroid
/// along x and y, and its turn, as the root mean square displacement about the centroid.
glm::dmat3 motion_covariance(const Body& body, const ObjectPose& pose);
/// Root mean square displacement of the body by the pose's deviations, mm.
double spread_mm(const Body& body, const ObjectPose& pose);

/// The pose of a body whose place is uncertain besides: by `sd_mm` along each axis, and by a turn
/// about its centroid that moves it as far.
ObjectPose displaced(const Body& body, ObjectPose pose, double sd_mm);
/// As above, of T_object_robot.
RefinedPose displaced(const Body& body, const RefinedPose& pose, double sd_mm);

}  // namespace palpate
