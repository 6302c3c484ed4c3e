#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>

#include "io/table_columns.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// A pose in space.
struct SpatialPose {
  glm::dvec3 translation_mm{0.0};
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};  ///< of length 1; w, x, y, z
};

/// Poses T_robot_sensor, row by row.
struct PoseTable {
  std::vector<double> time_s;        ///< [n], or empty
  std::vector<Pose> T_robot_sensor;  ///< [n]; unknown_pose where the row's cells are empty
  /// [n] in the place of T_robot_sensor, where the table has poses in space; none where the row's
  /// cells are empty.
  std::vector<std::optional<SpatialPose>> spatial;
  std::vector<double> height_mm;  ///< [n] above the plane of the touches, of poses in space
  std::array<Unit, 3> units{length_units[0], length_units[0], angle_units[0]};  ///< of x, y, theta
  bool assumed_units = false;  ///< neither names nor options give them: mm and rad
  std::string left_out = {};   ///< what of the table was not read, in a sentence; "": nothing
};

/// Reads poses from a CSV file with the columns x, y and theta (or yaw), or tx, ty, tz (or x, y, z)
/// and the quaternion qx, qy, qz, qw, and time where the poses have times; see TableOptions for
/// other names and units. A table without a header holds x, y and theta, or time, x, y and theta;
/// or all seven, or time and all seven, as trajectories of TUM do.
/// @param with_times false: poses by their rows alone; times are neither read nor checked
/// @throws Error, naming file, line and column, where a row is no pose, or not later than the one
/// before, or where a column roll, pitch, rx or ry turns an array of x, y and theta out of the
/// plane by more than 3 degrees
PoseTable read_poses(const std::filesystem::path& path, const TableOptions& options,
                     bool with_times = true);

}  // namespace palpate
