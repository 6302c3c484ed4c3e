#include "io/pose_table.hpp"

#include <cmath>
#include <limits>

#include "model/printable.hpp"
#include "palpate/touch.hpp"

namespace palpate {

namespace {

constexpr double most_turned_rad = 1e9;

struct PoseColumns {
  std::optional<UnitColumn> time;
  std::array<UnitColumn, 3> pose;
};

PoseColumns columns_without_names(const CsvTable& table, const TableOptions& options) {
  const std::size_t count = table.columns().size();
  if (count != 3 && count != 4) {
    table.refuse(
        "{} columns without names; write x, y, theta or time, x, y, theta, or add a "
        "header",
        count);
  }
  const auto column = [count](std::size_t from_end, const std::optional<Unit>& unit,
                              const Unit& usual) {
    return UnitColumn{.index = count - from_end, .unit = unit.value_or(usual), .assumed = !unit};
  };
  PoseColumns columns{.time = {},
                      .pose = {column(3, options.length_unit, length_units.front()),
                               column(2, options.length_unit, length_units.front()),
                               column(1, options.angle_unit, angle_units.front())}};
  if (count == 4) {
    columns.time = column(4, options.time_unit, time_units.front());
  }
  return columns;
}

PoseColumns find_columns(const CsvTable& table, const TableOptions& options) {
  const auto pose = find_pose(table, options);
  if (pose) {
    return {find_time(table, options), *pose};
  }
  if (!table.has_header()) {
    return columns_without_names(table, options);
  }
  const auto& [x, y, theta] = options.pose_columns;
  table.refuse("has no columns '{}', '{}' and '{}'; rename its columns{}",
               printable(x.empty() ? "x" : x), printable(y.empty() ? "y" : y),
               printable(theta.empty() ? "theta" : theta),
               options.may_name_poses ? ", or give `pose-columns X,Y,THETA`" : "");
}

Pose pose_in(const CsvTable& table, const std::array<UnitColumn, 3>& columns) {
  std::array<double, 3> values{};
  int known = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<double> number = table.number(columns[i].index);
    known += number ? 1 : 0;
    values[i] = columns[i].unit.convert(number.value_or(0.0));
    if (std::abs(values[i]) > (i < 2 ? farthest_mm : most_turned_rad)) {
      table.refuse(
          "column '{}': {} {} is further than any robot gets; check the number and its "
          "unit",
          printable(table.columns()[columns[i].index]), *number, columns[i].unit.name);
    }
  }
  if (known == 0) {
    return unknown_pose;
  }
  if (known < 3) {
    table.refuse("a part of the pose is empty; write x, y and theta, or leave all three empty");
  }
  return {{values[0], values[1]}, values[2]};
}

}  // namespace

PoseTable read_poses(const std::filesystem::path& path, const TableOptions& options,
                     bool with_times) {
  CsvTable table(path);
  const PoseColumns columns = find_columns(table, options);
  PoseTable poses;
  for (std::size_t i = 0; i < columns.pose.size(); ++i) {
    poses.units[i] = columns.pose[i].unit;
    poses.assumed_units = poses.assumed_units || columns.pose[i].assumed;
  }
  double last_s = -std::numeric_limits<double>::infinity();
  while (table.next()) {
    if (columns.time && with_times) {
      last_s = time_in(table, *columns.time, last_s, true);
      poses.time_s.push_back(last_s);
    }
    poses.T_robot_sensor.push_back(pose_in(table, columns.pose));
  }
  if (poses.T_robot_sensor.empty()) {
    refuse(path, "holds a header and no row; write a row for each pose");
  }
  return poses;
}

}  // namespace palpate
