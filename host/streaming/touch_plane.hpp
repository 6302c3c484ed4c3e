#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "io/pose_table.hpp"
#include "palpate/touch.hpp"
#include "streaming/import_array.hpp"

namespace palpate {

/// The plane in which an array touches, found from poses in space.
struct TouchPlane {
  glm::dvec3 normal{0.0, 0.0, 1.0};  ///< of the robot frame, of length 1
  glm::dvec3 x{1.0, 0.0, 0.0};  ///< axes in the plane, as the robot's x and y where it is its own
  glm::dvec3 y{0.0, 1.0, 0.0};
  /// The array looks against the normal, as under a tool that points down: seen from the normal's
  /// side its y axis is mirrored.
  bool faces_down = false;

  /// T_robot_sensor in the plane, of an array whose y axis is turned over where it faces down.
  Pose project(const SpatialPose& pose) const;
  /// Along the normal.
  double height_mm(const SpatialPose& pose) const;
  /// Angle between the array and the plane.
  double tilt_rad(const SpatialPose& pose) const;
};

/// The plane across the mean direction in which the array looks: the robot's xy plane where that is
/// within 3 degrees of it. The normal points to the side of the robot's z, or in a steep plane of
/// its x or y.
/// @param normal of the plane, of any length; none: found
/// @throws Error naming the option `plane` where the array looks in all directions
TouchPlane touch_plane(const std::vector<std::optional<SpatialPose>>& poses,
                       const std::optional<glm::dvec3>& normal);

/// The normal that `plane` gives as "NX,NY,NZ"; none of "auto". @throws Error naming the option
std::optional<glm::dvec3> plane_normal(const std::string& plane);

/// Takes a table's poses in space into the plane of the touches, with their heights above it, turns
/// the recording's array over where it faces down, and gives it its findings "tilt".
/// @returns what to say of the plane, in sentences
std::vector<std::string> take_into_plane(const TouchPlane& plane, const ImportSurvey& survey,
                                         PoseTable& poses, Recording& recording);

}  // namespace palpate
