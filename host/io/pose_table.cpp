#include "io/pose_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include <fmt/ranges.h>

#include "model/printable.hpp"
#include "palpate/touch.hpp"

namespace palpate {

namespace {

constexpr double most_turned_rad = 1e9;

constexpr std::size_t in_space = 7;  // columns

struct PoseColumns {
  std::optional<UnitColumn> time;
  std::vector<UnitColumn> pose;  ///< of x, y, theta, or of a position and a quaternion
};

PoseColumns columns_without_names(const CsvTable& table, const TableOptions& options) {
  const std::size_t count = table.columns().size();
  const std::size_t of_pose = count >= in_space ? in_space : 3;
  if (count != of_pose && count != of_pose + 1) {
    table.refuse(
        "{} columns without names; write x, y, theta or tx, ty, tz, qx, qy, qz, qw, with or "
        "without a time before them, or add a header",
        count);
  }
  const auto column = [](std::size_t index, const std::optional<Unit>& unit, const Unit& usual) {
    return UnitColumn{.index = index, .unit = unit.value_or(usual), .assumed = !unit};
  };
  PoseColumns columns;
  std::size_t index = 0;
  if (count > of_pose) {
    columns.time = column(index++, options.time_unit, time_units.front());
  }
  const std::size_t lengths = of_pose == in_space ? 3 : 2;
  for (std::size_t i = 0; i < of_pose; ++i) {
    columns.pose.push_back(i < lengths ? column(index++, options.length_unit, length_units.front())
                           : of_pose == in_space
                               ? UnitColumn{.index = index++}
                               : column(index++, options.angle_unit, angle_units.front()));
  }
  return columns;
}

PoseColumns find_columns(const CsvTable& table, const TableOptions& options) {
  std::vector<UnitColumn> pose = find_pose(table, options);
  if (!pose.empty()) {
    return {find_time(table, options), std::move(pose)};
  }
  if (!table.has_header()) {
    return columns_without_names(table, options);
  }
  std::vector<std::string> names = options.pose_columns;
  if (names.empty()) {
    names = {"x", "y", "theta"};
  }
  std::ranges::transform(names, names.begin(),
                         [](const std::string& name) { return std::string(printable(name)); });
  const std::string last = std::move(names.back());
  names.pop_back();
  table.refuse("has no columns '{}' and '{}'; rename its columns{}",
               fmt::format("{}", fmt::join(names, "', '")), last,
               options.may_name_poses ? ", or give `pose-columns X,Y,THETA` or "
                                        "`pose-columns TX,TY,TZ,QX,QY,QZ,QW`"
                                      : "");
}

/// Columns of rotations out of the plane, and of the height, that poses of x, y and theta leave
/// out.
struct LeftOut {
  std::vector<UnitColumn> rotations;
  std::optional<UnitColumn> height;
};

LeftOut left_out_of(const CsvTable& table, const PoseColumns& columns,
                    const TableOptions& options) {
  constexpr Quantity rotations[] = {{"roll", angle_units, "pose-unit"},
                                    {"pitch", angle_units, "pose-unit"},
                                    {"rx", angle_units, "pose-unit"},
                                    {"ry", angle_units, "pose-unit"}};
  constexpr Quantity height{"z", length_units, "pose-unit"};
  const auto taken = [&](const std::optional<UnitColumn>& column) {
    return column &&
           std::ranges::find(columns.pose, column->index, &UnitColumn::index) != columns.pose.end();
  };
  LeftOut left_out;
  if (!table.has_header()) {
    return left_out;
  }
  for (const Quantity& quantity : rotations) {
    const auto column = find_column(table, quantity, "", options.angle_unit);
    if (column && !taken(column)) {
      left_out.rotations.push_back(*column);
    }
  }
  left_out.height = find_column(table, height, "", options.length_unit);
  if (taken(left_out.height)) {
    left_out.height.reset();
  }
  return left_out;
}

/// Refuses a row whose rotation does not leave the array flat in the xy plane.
void require_flat(const CsvTable& table, std::span<const UnitColumn> rotations) {
  constexpr double most_rad = 3.0 * std::numbers::pi / 180.0;
  for (const UnitColumn& column : rotations) {
    const double turned = column.unit.convert(table.number(column.index).value_or(0.0));
    if (!(std::abs(wrap_angle(turned)) <= most_rad)) {
      table.refuse(
          "column '{}': the array is turned by {:.0f} degrees out of the xy plane, which x, y and "
          "an angle do not tell; write the rotation as a quaternion: columns tx, ty, tz, qx, qy, "
          "qz and qw",
          printable(table.columns()[column.index]), turned * 180.0 / std::numbers::pi);
    }
  }
}

/// The numbers of the columns in mm and rad; none where all cells are empty.
std::optional<std::vector<double>> numbers_in(const CsvTable& table,
                                              std::span<const UnitColumn> columns) {
  std::vector<double> values;
  std::size_t known = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::optional<double> number = table.number(columns[i].index);
    known += number ? 1 : 0;
    values.push_back(columns[i].unit.convert(number.value_or(0.0)));
    const bool is_length = i < (columns.size() == in_space ? 3 : 2);
    if (std::abs(values[i]) > (is_length ? farthest_mm : most_turned_rad)) {
      table.refuse(
          "column '{}': {} {} is further than any robot gets; check the number and its "
          "unit",
          printable(table.columns()[columns[i].index]), *number, columns[i].unit.name);
    }
  }
  if (known == 0) {
    return {};
  }
  if (known < columns.size()) {
    const char* all =
        columns.size() == in_space ? "tx, ty, tz, qx, qy, qz and qw" : "x, y and theta";
    table.refuse("a part of the pose is empty; write {}, or leave all {} empty", all,
                 columns.size() == in_space ? "seven" : "three");
  }
  return values;
}

SpatialPose pose_in_space(const CsvTable& table, std::span<const double> v) {
  const glm::dquat rotation(v[6], v[3], v[4], v[5]);
  const double length = glm::length(rotation);
  constexpr double rounding = 1e-2;  // three decimals of a log leave less
  if (std::abs(length - 1.0) > rounding) {
    table.refuse(
        "the quaternion's length is {:.4g}, so that it is no rotation; write qx, qy, qz "
        "and qw in this order, of length 1",
        length);
  }
  return {{v[0], v[1], v[2]}, rotation / length};
}

}  // namespace

PoseTable read_poses(const std::filesystem::path& path, const TableOptions& options,
                     bool with_times) {
  CsvTable table(path);
  const PoseColumns columns = find_columns(table, options);
  PoseTable poses;
  const bool spatial = columns.pose.size() == in_space;
  for (std::size_t i = 0; i < (spatial ? 2 : 3); ++i) {
    poses.units[i] = columns.pose[i].unit;
    poses.assumed_units = poses.assumed_units || columns.pose[i].assumed;
  }
  const LeftOut left_out = spatial ? LeftOut() : left_out_of(table, columns, options);
  if (left_out.height) {
    poses.left_out = fmt::format(
        "its column '{}' was left out; poses with a quaternion (tx, ty, tz, qx, qy, qz and qw) "
        "have "
        "a height",
        printable(table.columns()[left_out.height->index]));
  }
  double last_s = -std::numeric_limits<double>::infinity();
  while (table.next()) {
    require_flat(table, left_out.rotations);
    if (columns.time && with_times) {
      last_s = time_in(table, *columns.time, last_s, true);
      poses.time_s.push_back(last_s);
    }
    const auto numbers = numbers_in(table, columns.pose);
    if (spatial) {
      poses.spatial.push_back(numbers ? std::optional(pose_in_space(table, *numbers))
                                      : std::nullopt);
    } else {
      poses.T_robot_sensor.push_back(numbers ? Pose{{(*numbers)[0], (*numbers)[1]}, (*numbers)[2]}
                                             : unknown_pose);
    }
  }
  if (poses.T_robot_sensor.empty() && poses.spatial.empty()) {
    refuse(path, "holds a header and no row; write a row for each pose");
  }
  return poses;
}

}  // namespace palpate
