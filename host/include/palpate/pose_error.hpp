#pragma once

#include <optional>

#include <glm/vec2.hpp>

#include "palpate/api.hpp"
#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// A body of uniform density over a map's occupied cells (log odds > 0), in the object frame.
struct Body {
  glm::dvec2 centroid_mm{0.0, 0.0};
  double inertia_mm2 = 0.0;  ///< mean squared distance from the centroid
};

/// Returns the body of a map. @throws Error if no cell is occupied
PALPATE_API Body body_of(const OccupancyGrid& map);

/// Returns the root mean squared displacement of the body between the estimated and the true pose,
/// in mm (Chirikjian and Zhou 1998; Eq. 17-20): sqrt(|dc|^2 + 2 J (1 - cos dtheta)), where dc is
/// the difference of the centroids in the robot frame and J is `inertia_mm2`. Symmetry n wraps
/// dtheta into [-pi/n, pi/n); n = 0, full symmetry, sets it to 0. A translation by 1 mm scores 1.
PALPATE_API double pose_error_mm(const Body& body, int symmetry,
                                 const Pose& T_object_robot_estimate,
                                 const Pose& T_object_robot_truth);

/// Returns the pose nearest in angle to the estimate among those that the symmetry makes equal to
/// the truth: the pose that pose_error_mm() compares the estimate with.
PALPATE_API Pose nearest_equal_pose(const Body& body, int symmetry,
                                    const Pose& T_object_robot_estimate,
                                    const Pose& T_object_robot_truth);

/// Returns the pose among those that the symmetry makes equal whose inverse, T_robot_object, has
/// theta within [-pi/n, pi/n); with n = 0, theta = 0. The turn is about the body's centroid; where
/// there is no body, or n = 1, the pose is returned as it is.
PALPATE_API Pose least_turned(const std::optional<Body>& body, int symmetry,
                              const Pose& T_object_robot);
/// least_turned() of a pose whose covariance turns with it.
PALPATE_API RefinedPose least_turned(const std::optional<Body>& body, int symmetry,
                                     const RefinedPose& refined);

}  // namespace palpate
