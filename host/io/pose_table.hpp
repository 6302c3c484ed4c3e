#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "io/table_columns.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// Poses T_robot_sensor, row by row.
struct PoseTable {
  std::vector<double> time_s;        ///< [n], or empty
  std::vector<Pose> T_robot_sensor;  ///< [n]; unknown_pose where the row's cells are empty
  std::array<Unit, 3> units;         ///< of the columns x, y and theta
  bool assumed_units = false;        ///< neither names nor options give them: mm and rad
};

/// Reads poses from a CSV file with the columns x, y and theta (or yaw), and time where the poses
/// have times; see TableOptions for other names and units. A table without a header holds x, y and
/// theta, or time, x, y and theta.
/// @param with_times false: poses by their rows alone; times are neither read nor checked
/// @throws Error, naming file, line and column, where a row is no pose, or not later than the one
/// before
PoseTable read_poses(const std::filesystem::path& path, const TableOptions& options,
                     bool with_times = true);

}  // namespace palpate
