#include "io/pose_table.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include <fmt/ranges.h>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "io/recording_rules.hpp"
#include "model/number_text.hpp"
#include "model/printable.hpp"
#include "palpate/touch.hpp"

namespace palpate {

namespace {

constexpr double rounding = 1e-2;  // three decimals of a log leave less

std::size_t axis_of(char letter) {
  return static_cast<std::size_t>(std::tolower(static_cast<unsigned char>(letter)) - 'x');
}

struct TableColumns {
  std::optional<UnitColumn> time;
  PoseColumns pose;
};

/// x, y and an angle, or a position and a quaternion, perhaps behind a time.
TableColumns columns_without_names(const CsvTable& table, const TableOptions& options) {
  const std::size_t count = table.columns().size();
  const bool has_time = count == 4 || count == 8;
  std::vector<std::size_t> indices(has_time ? count - 1 : count);
  std::iota(indices.begin(), indices.end(), has_time ? 1 : 0);
  if (indices.size() != 3 && indices.size() != 7) {
    table.refuse(
        "{} columns without names; write x, y, theta or tx, ty, tz, qx, qy, qz, qw, with or "
        "without a time before them, or add a header",
        count);
  }
  const PoseForm form = indices.size() == 3 ? PoseForm::planar : PoseForm::quaternion;
  return {has_time ? std::optional(unit_column(table, 0, time_units, options)) : std::nullopt,
          pose_columns(table, form, indices, options)};
}

/// True where the first column stands alone before the pose and counts or labels nothing.
bool may_be_time(const CsvTable& table, const PoseColumns& pose, const TableOptions& options) {
  constexpr std::string_view others = "frame touch row index seq n id label object";
  const std::string& name = table.columns()[0];
  const auto is_name = [&](std::string_view other) { return alike(other, name); };
  return std::ranges::min(pose.columns, {}, &UnitColumn::index).index == 1 && !name.empty() &&
         std::ranges::none_of(split_text(others, ' '), is_name) &&
         std::ranges::none_of(conditions(options), is_name,
                              &std::pair<std::string, std::string>::first);
}

TableColumns find_columns(const CsvTable& table, const TableOptions& options) {
  PoseColumns pose = find_pose(table, options);
  if (pose.columns.empty() && !table.has_header()) {
    return columns_without_names(table, options);
  }
  if (pose.columns.empty()) {
    table.refuse_columns("has no columns 'x', 'y' and 'theta'; rename its columns{}",
                         options.may_name_poses
                             ? ", or name them by `pose-columns`: X,Y,THETA, or in space "
                               "X,Y,Z,ROLL,PITCH,YAW or TX,TY,TZ,QX,QY,QZ,QW"
                             : "");
  }
  std::optional<UnitColumn> time = find_time(table, options);
  if (!time && options.needs_times && may_be_time(table, pose, options)) {
    time = unit_column(table, 0, time_units, options);
  }
  return {time, std::move(pose)};
}

/// The columns of these names that are no part of the pose.
std::vector<UnitColumn> columns_beside(const PoseColumns& pose, const CsvTable& table,
                                       std::initializer_list<const char*> names,
                                       std::span<const Unit> units, const TableOptions& options) {
  std::vector<UnitColumn> beside;
  for (const char* name : names) {
    const auto column = find_column(table, name, units, options);
    if (column &&
        std::ranges::find(pose.columns, column->index, &UnitColumn::index) == pose.columns.end()) {
      beside.push_back(*column);
    }
  }
  return beside;
}

/// Refuses a row whose rotation does not leave the array flat in the xy plane.
void require_flat(const CsvTable& table, std::span<const UnitColumn> rotations) {
  constexpr double most_rad = 3.0 * std::numbers::pi / 180.0;
  for (const UnitColumn& column : rotations) {
    const double turned = column.unit.convert(table.number(column.index).value_or(0.0));
    if (!(std::abs(wrap_angle(turned)) <= most_rad)) {
      table.refuse(
          "column '{}': the array is turned by {:.0f} degrees out of the xy plane, which x, y and "
          "an angle do not tell; name all columns of the pose by `pose-columns`, such as "
          "x,y,z,roll,pitch,yaw",
          printable(table.columns()[column.index]), turned * 180.0 / std::numbers::pi);
    }
  }
}

/// The numbers of the columns in their units' mm and rad; none where all cells are empty.
std::optional<std::vector<double>> numbers_in(const CsvTable& table,
                                              std::span<const UnitColumn> columns) {
  std::vector<double> values;
  std::vector<std::string> empty;
  for (const UnitColumn& column : columns) {
    const std::optional<double> number = table.number(column.index);
    if (!number) {
      empty.push_back(fmt::format("'{}'", printable(table.columns()[column.index])));
    }
    values.push_back(column.unit.convert(number.value_or(0.0)));
    if (std::abs(values.back()) > farthest_mm) {  // or as many rad
      table.refuse(
          "column '{}': {} {} is further than any robot gets; check the number and its "
          "unit",
          printable(table.columns()[column.index]), *number, column.unit.name);
    }
  }
  if (empty.size() == columns.size()) {
    return {};
  }
  if (!empty.empty()) {
    table.refuse("a part of the pose is empty: {}; write all {} numbers, or leave all empty",
                 fmt::format("{}", fmt::join(empty, ", ")), columns.size());
  }
  return values;
}

/// None where the quaternion is of zeros.
std::optional<SpatialPose> pose_of_quaternion(const CsvTable& table, std::span<const double> v) {
  const glm::dquat rotation(v[6], v[3], v[4], v[5]);
  const double length = glm::length(rotation);
  if (length == 0.0) {
    return {};
  }
  if (std::abs(length - 1.0) > rounding) {
    table.refuse(
        "the quaternion's length is {:.4g}, so that it is no rotation; write qx, qy, qz "
        "and qw in this order, of length 1",
        length);
  }
  return SpatialPose{{v[0], v[1], v[2]}, rotation / length};
}

/// The pose that a matrix tells; none where the numbers are no rotation and position.
/// @param in_mm numbers in the unit of the position, which is not that of the rotation
std::optional<SpatialPose> matrix_of(const PoseColumns& columns, std::span<const double> in_mm,
                                     bool by_columns) {
  const Unit& unit = columns.columns.front().unit;
  std::vector<double> numbers(in_mm.begin(), in_mm.end());
  for (double& number : numbers) {
    number *= unit.divisor / unit.multiplier;
  }
  auto pose = pose_of_matrix(numbers, by_columns);
  if (pose) {
    pose->translation_mm *= unit.multiplier / unit.divisor;
  }
  return pose;
}

/// Whether matrices are written by columns, by the first row that only one of the two ways makes a
/// pose.
bool is_by_columns(const std::filesystem::path& path, const PoseColumns& columns,
                   const TableOptions& options) {
  if (columns.form != PoseForm::matrix || !options.matrix.empty()) {
    return options.matrix == "columns";
  }
  CsvTable table = open_table(path, options);
  while (table.next()) {
    const auto numbers = numbers_in(table, columns.columns);
    const bool by_columns = numbers && matrix_of(columns, *numbers, true);
    const bool by_rows = numbers && matrix_of(columns, *numbers, false);
    if (by_columns != by_rows) {
      return by_columns;
    }
    if (numbers && !by_columns) {
      table.refuse(
          "the numbers are no rotation and position, read by columns or by rows; name the 12 or "
          "16 columns of the matrix in its order");
    }
  }
  refuse(path,
         "its matrices may be written by columns or by rows; give `matrix columns` or "
         "`matrix rows`");
}

/// How the rotations of poses in space are written.
struct RotationRules {
  std::string axes;  ///< of three angles
  bool by_columns;   ///< of matrices
};

/// The row's pose in space; none where its cells are empty.
std::optional<SpatialPose> spatial_pose(const CsvTable& table, const PoseColumns& columns,
                                        const RotationRules& rules) {
  const auto numbers = numbers_in(table, columns.columns);
  if (!numbers) {
    return {};
  }
  const std::vector<double>& v = *numbers;
  switch (columns.form) {
    case PoseForm::euler:
      return SpatialPose{{v[0], v[1], v[2]},
                         rotation_of_angles(rules.axes, std::span(v).subspan(3))};
    case PoseForm::rotation_vector:
      return SpatialPose{{v[0], v[1], v[2]}, rotation_of_vector({v[3], v[4], v[5]})};
    case PoseForm::matrix: {
      const auto pose = matrix_of(columns, v, rules.by_columns);
      if (!pose) {
        table.refuse(
            "the numbers are no rotation and position, read by {}; correct them, or give "
            "`matrix {}`",
            rules.by_columns ? "columns" : "rows", rules.by_columns ? "rows" : "columns");
      }
      return pose;
    }
    default:
      return pose_of_quaternion(table, v);
  }
}

/// What the columns of poses in space are, in a sentence.
std::string words_about(const CsvTable& table, const PoseColumns& columns,
                        const RotationRules& rules) {
  std::string form;
  switch (columns.form) {
    case PoseForm::euler:
      form = fmt::format(
          "its poses are x, y, z and angles about the {} axes {} one after another (`euler`)",
          rules.axes[0] >= 'x' ? "fixed" : "moving", rules.axes);
      break;
    case PoseForm::rotation_vector:
      form = "its poses are x, y, z and a rotation vector";
      break;
    case PoseForm::matrix:
      form = fmt::format("its poses are matrices written by {} (`matrix`)",
                         rules.by_columns ? "columns" : "rows");
      break;
    default:
      form = "its poses are x, y, z and a quaternion x, y, z, w";
      break;
  }
  const UnitColumn& first = columns.columns.front();
  const UnitColumn& last = columns.columns.back();
  const bool is_matrix = columns.form == PoseForm::matrix;
  return fmt::format(
      "{}, columns '{}' to '{}', in {}{}", form, printable(table.columns()[first.index]),
      printable(table.columns()[last.index]), first.unit.name,
      is_matrix || last.unit.name.empty() ? "" : fmt::format(" and {}", last.unit.name));
}

}  // namespace

SpatialPose operator*(const SpatialPose& a, const SpatialPose& b) {
  return {a.translation_mm + a.rotation * b.translation_mm, a.rotation * b.rotation};
}

glm::dquat rotation_of_angles(std::string_view axes, std::span<const double> rad) {
  glm::dquat rotation{1.0, 0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    glm::dvec3 axis{0.0};
    axis[static_cast<int>(axis_of(axes[i]))] = 1.0;
    const glm::dquat turn = rotation_of_vector(rad[i] * axis);
    const bool is_fixed = std::islower(static_cast<unsigned char>(axes[i])) != 0;
    rotation = is_fixed ? turn * rotation : rotation * turn;
  }
  return rotation;
}

glm::dquat rotation_of_vector(const glm::dvec3& v) {
  const double angle = glm::length(v);
  return angle == 0.0 ? glm::dquat(1.0, 0.0, 0.0, 0.0) : glm::angleAxis(angle, v / angle);
}

std::optional<SpatialPose> pose_of_matrix(std::span<const double> numbers, bool by_columns) {
  const std::size_t rows = numbers.size() / 4;  // of four columns
  const auto at = [&](std::size_t row, std::size_t column) {
    return by_columns ? numbers[column * rows + row] : numbers[row * 4 + column];
  };
  glm::dmat3 r;
  SpatialPose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      r[column][row] = at(static_cast<std::size_t>(row), static_cast<std::size_t>(column));
    }
    pose.translation_mm[row] = at(static_cast<std::size_t>(row), 3);
  }
  bool is_one = std::abs(glm::determinant(r) - 1.0) <= rounding;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      is_one = is_one && std::abs(glm::dot(r[i], r[j]) - (i == j ? 1.0 : 0.0)) <= rounding;
    }
  }
  for (std::size_t column = 0; column < 4 && rows == 4; ++column) {
    is_one = is_one && std::abs(at(3, column) - (column == 3 ? 1.0 : 0.0)) <= 1e-6;
  }
  pose.rotation = glm::normalize(glm::quat_cast(r));
  return is_one ? std::optional(pose) : std::nullopt;
}

PoseTable read_poses(const std::filesystem::path& path, const TableOptions& options,
                     bool with_times) {
  CsvTable table = open_table(path, options);
  const auto [time, pose] = find_columns(table, options);
  PoseTable poses;
  const bool is_planar = pose.form == PoseForm::planar;
  const bool has_angles = pose.form == PoseForm::euler || pose.form == PoseForm::rotation_vector;
  if ((!options.euler.empty() && !has_angles) ||
      (!options.matrix.empty() && pose.form != PoseForm::matrix)) {
    refuse(path,
           "its poses are of another form than `euler` or `matrix` is for; leave it out, or "
           "name other columns by `pose-columns`");
  }
  const Unit angle_unit = is_planar || has_angles ? pose.columns.back().unit : angle_units[0];
  poses.units = {pose.columns[0].unit, pose.columns[1].unit,
                 given_unit(options, angle_units).value_or(angle_unit)};
  poses.assumed_units = assumed_words(table, pose.columns);
  // Poses of x, y and an angle leave out the height and rotations out of the plane.
  std::vector<UnitColumn> rotations;
  if (is_planar) {
    rotations = columns_beside(pose, table, {"roll", "pitch", "rx", "ry"}, angle_units, options);
    for (const UnitColumn& height : columns_beside(pose, table, {"z"}, length_units, options)) {
      poses.understood.push_back(fmt::format(
          "its column '{}' was left out; poses in space (with roll, pitch and yaw, or a "
          "quaternion) have a height",
          printable(table.columns()[height.index])));
    }
  }
  const RotationRules rules{options.euler.empty() ? "xyz" : options.euler,
                            is_by_columns(path, pose, options)};
  if (table.skipped_lines() > 0) {
    poses.understood.push_back(skipped_words(table));
  }
  if (options.needs_times && !find_time(table, options) &&
      (table.has_header() || !options.pose_columns.empty())) {
    poses.understood.push_back(
        time ? fmt::format("its column '{}' is taken for its times, in {} (`time-column`)",
                           printable(table.columns()[time->index]), time->unit.name)
             : "its poses have no times (`time-column`), and are taken row by row");
  }
  if (!is_planar) {
    poses.understood.push_back(words_about(table, pose, rules));
  }
  TableTimes times(table, time.value_or(UnitColumn()));
  std::uint64_t repeated = 0;
  std::uint64_t zeros = 0;
  while (table.next()) {
    require_flat(table, rotations);
    if (time && with_times) {
      const double time_s = times.next(poses.time_s.size());
      if (!poses.time_s.empty() && time_s == poses.time_s.back()) {
        if (is_planar ? is_finite(poses.T_robot_sensor.back()) : poses.spatial.back().has_value()) {
          ++repeated;
          continue;
        }
        poses.time_s.pop_back();
        is_planar ? poses.T_robot_sensor.pop_back() : poses.spatial.pop_back();
      }
      poses.time_s.push_back(time_s);
    }
    if (is_planar) {
      const auto numbers = numbers_in(table, pose.columns);
      poses.T_robot_sensor.push_back(numbers ? Pose{{(*numbers)[0], (*numbers)[1]}, (*numbers)[2]}
                                             : unknown_pose);
    } else {
      poses.spatial.push_back(spatial_pose(table, pose, rules));
      zeros += !poses.spatial.back() && table.number(pose.columns.front().index) ? 1 : 0;
    }
  }
  if (poses.T_robot_sensor.empty() && poses.spatial.empty()) {
    refuse(path, "holds a header and no row; write a row for each pose");
  }
  if (repeated > 0) {
    poses.understood.push_back(fmt::format(
        "{} of its rows repeat the time of the row before, whose pose is kept", repeated));
  }
  if (zeros > 0) {
    poses.understood.push_back(
        fmt::format("{} of its poses are unknown, as their quaternion is of zeros", zeros));
  }
  poses.steps = std::move(times.steps);
  return poses;
}

}  // namespace palpate
