#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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

/// The pose `b`, given in the frame of `a`, in the frame in which `a` is.
SpatialPose operator*(const SpatialPose& a, const SpatialPose& b);

/// Turns by the angles about the axes one after another, as SciPy's Rotation.from_euler(): lower
/// case, about fixed axes; upper case, about those that the turns before have moved.
/// @param axes three of x, y and z, none of which follows itself
/// @param rad three angles
glm::dquat rotation_of_angles(std::string_view axes, std::span<const double> rad);

/// The rotation about a vector, by its length in rad.
glm::dquat rotation_of_vector(const glm::dvec3& v);

/// Poses T_robot_sensor, row by row.
struct PoseTable {
  std::vector<double> time_s;        ///< [n], or empty
  std::vector<Pose> T_robot_sensor;  ///< [n]; unknown_pose where the row's cells are empty
  /// [n] in the place of T_robot_sensor, where the table has poses in space; none where the row's
  /// cells are empty, or its quaternion is of zeros, as of a robot that does not know.
  std::vector<std::optional<SpatialPose>> spatial;
  std::vector<double> height_mm;  ///< [n] above the plane of the touches, of poses in space
  std::array<Unit, 3> units{length_units[0], length_units[0], angle_units[0]};  ///< of x, y, theta
  std::string assumed_units = {};            ///< see assumed_words()
  std::vector<ClockStep> steps = {};         ///< where the clock steps back
  std::vector<std::string> understood = {};  ///< what was not plain, in sentences
};

/// Reads poses from a CSV file with the columns x, y and theta (or yaw), or tx, ty, tz (or x, y, z)
/// and a rotation: the quaternion qx, qy, qz, qw; roll, pitch and yaw; or the rotation vector rx,
/// ry, rz; and time where the poses have times. See TableOptions for other names and units. A table
/// without a header holds x, y and theta, or time, x, y and theta; or a position and a quaternion,
/// or time and these, as trajectories of TUM do. Of poses at one time the first is kept.
/// @param with_times false: poses by their rows alone; times are neither read nor checked
/// @throws Error, naming file, line and column, where a row is no pose, or where a column roll,
/// pitch, rx or ry turns an array of x, y and theta out of the plane by more than 3 degrees
PoseTable read_poses(const std::filesystem::path& path, const TableOptions& options,
                     bool with_times = true);

/// The form of poses in rows of so many numbers, which have no names to tell it.
/// @param name of the rows, for messages
/// @throws Error where they are no pose, or the options do not say what six numbers are
PoseForm form_of_rows(const std::string& name, std::size_t width, const TableOptions& options);

/// Poses of rows of `width` numbers: x, y and an angle, which lie in the xy plane; x, y, z and the
/// angles or the vector that `euler` says; a position and a quaternion x, y, z, w; or a matrix. In
/// the units of `pose_unit`, else mm and rad; unknown where a number is not finite.
/// @throws Error as form_of_rows(), and naming the row that is no pose
PoseTable poses_of_rows(const std::string& name, std::span<const double> numbers, std::size_t width,
                        const TableOptions& options);

}  // namespace palpate
