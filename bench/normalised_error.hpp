#pragma once

#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate::bench {

/// What normalised_error() is on average where covariances are right: one for every coordinate.
inline constexpr double expected_normalised_error = 3.0;

/// The squared error of a refined pose over its covariance C, e' C^-1 e (normalised estimation
/// error squared, NEES; Bar-Shalom, Li and Kirubarajan 2001). e is the difference of (x, y, theta)
/// of T_object_robot from the truth, of the poses that the map's symmetry makes equal to it the
/// nearest. An object of full symmetry has no angle: e is then the difference of x and y of the
/// object's centroid in the robot frame, C is carried over to it by the Jacobian, and the result is
/// taken times 3/2. So it is 3 on average for every object.
/// @param map the estimated object's, which is the true one. @throws Error if no cell is occupied
double normalised_error(const OccupancyGrid& map, const RefinedPose& refined,
                        const Pose& T_object_robot_truth);

}  // namespace palpate::bench
