#include "io/pose_table.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>
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

/// The pose that 12 or 16 numbers of a homogeneous matrix tell, [R t] or [R t; 0 1]; none where it
/// is no rotation.
std::optional<SpatialPose> pose_of_matrix(std::span<const double> numbers, const Unit& length,
                                          bool by_columns) {
  if (numbers.empty()) {
    return {};
  }
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
    pose.translation_mm[row] = length.convert(at(static_cast<std::size_t>(row), 3));
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

/// How rows of numbers tell poses in space.
struct PoseRules {
  PoseForm form;
  std::vector<Unit> units;   ///< of each number, of matrices the first
  std::string axes = "xyz";  ///< of three angles
  bool by_columns = false;   ///< of matrices
};

/// Goes on to the next row, which is empty where it is not known; false after the last.
using NextRow = std::function<bool(std::vector<double>& row)>;
/// Refuses the row that is read, for this reason.
using RefuseRow = std::function<void(const std::string& why)>;

/// Completes the rules by the options, and where these do not say how matrices are written, by the
/// first row that only one of the two ways makes a pose.
void complete(PoseRules& rules, const TableOptions& options, const NextRow& next,
              const RefuseRow& refuse, const std::string& place) {
  const bool is_matrix = rules.form == PoseForm::matrix;
  if ((!options.euler.empty() && !is_of_angles(rules.form)) ||
      (!options.matrix.empty() && !is_matrix)) {
    palpate::refuse(place,
                    "its poses are of another form than `euler` or `matrix` is for; leave it out, "
                    "or name other columns or fields");
  }
  rules.axes = options.euler.empty() ? "xyz" : options.euler;
  rules.by_columns = options.matrix == "columns";
  bool is_told = !is_matrix || !options.matrix.empty();
  for (std::vector<double> row; !is_told;) {
    if (!next(row)) {
      palpate::refuse(place,
                      "its matrices may be written by columns or by rows; give `matrix columns` or "
                      "`matrix rows`");
    }
    rules.by_columns = pose_of_matrix(row, rules.units[0], true).has_value();
    is_told = rules.by_columns != pose_of_matrix(row, rules.units[0], false).has_value();
    if (!is_told && !row.empty() && !rules.by_columns) {
      refuse(
          "the numbers are no rotation and position, read by columns or by rows; give the 12 or "
          "16 numbers of the matrix in its order");
    }
  }
}

/// The pose of a row; none where the row is empty, or its quaternion of zeros.
std::optional<SpatialPose> spatial_pose(const PoseRules& rules, std::span<const double> row,
                                        const RefuseRow& refuse) {
  if (row.empty()) {
    return {};
  }
  if (rules.form == PoseForm::matrix) {
    const auto pose = pose_of_matrix(row, rules.units[0], rules.by_columns);
    if (!pose) {
      refuse(fmt::format(
          "the numbers are no rotation and position, read by {}; correct them, or "
          "give `matrix {}`",
          rules.by_columns ? "columns" : "rows", rules.by_columns ? "rows" : "columns"));
    }
    return pose;
  }
  std::array<double, 7> v{};
  std::ranges::transform(rules.units, row, v.begin(), &Unit::convert);
  if (rules.form == PoseForm::planar) {
    return SpatialPose{{v[0], v[1], 0.0}, rotation_of_vector({0.0, 0.0, v[2]})};
  }
  SpatialPose pose{{v[0], v[1], v[2]}};
  if (rules.form == PoseForm::euler) {
    pose.rotation = rotation_of_angles(rules.axes, std::span(v).subspan(3, 3));
  } else if (rules.form == PoseForm::rotation_vector) {
    pose.rotation = rotation_of_vector({v[3], v[4], v[5]});
  } else {
    const glm::dquat rotation(v[6], v[3], v[4], v[5]);
    const double length = glm::length(rotation);
    if (length == 0.0) {
      return {};
    }
    if (std::abs(length - 1.0) > rounding) {
      refuse(
          fmt::format("the quaternion's length is {:.4g}, so that it is no rotation; write qx, "
                      "qy, qz and qw in this order, of length 1",
                      length));
    }
    pose.rotation = rotation / length;
  }
  return pose;
}

/// What the rows of these columns are, in a sentence.
std::string words_about(const PoseRules& rules, const std::string& columns = "") {
  std::string form = "x, y, z and a quaternion x, y, z, w";
  if (rules.form == PoseForm::euler) {
    form = fmt::format("x, y, z and angles about the {} axes {} one after another (`euler`)",
                       rules.axes[0] >= 'x' ? "fixed" : "moving", rules.axes);
  } else if (rules.form == PoseForm::rotation_vector) {
    form = "x, y, z and a rotation vector";
  } else if (rules.form == PoseForm::matrix) {
    form = fmt::format("matrices written by {} (`matrix`)", rules.by_columns ? "columns" : "rows");
  }
  return fmt::format(
      "its poses are {}{}, in {}{}", form, columns, rules.units.front().name,
      is_of_angles(rules.form) ? fmt::format(" and {}", rules.units.back().name) : "");
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

/// The numbers of the columns; none where all cells are empty.
std::vector<double> numbers_in(const CsvTable& table, std::span<const UnitColumn> columns) {
  std::vector<double> values;
  std::vector<std::string> empty;
  for (const UnitColumn& column : columns) {
    const std::optional<double> number = table.number(column.index);
    if (!number) {
      empty.push_back(fmt::format("'{}'", printable(table.columns()[column.index])));
    }
    values.push_back(number.value_or(0.0));
    if (std::abs(column.unit.convert(values.back())) > farthest_mm) {  // or as many rad
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

PoseTable read_poses(const std::filesystem::path& path, const TableOptions& options,
                     bool with_times) {
  CsvTable table = open_table(path, options);
  const TimedPoseColumns found = find_columns(table, options);
  const std::optional<UnitColumn>& time = found.time;
  const PoseColumns& pose = found.pose;  // no structured binding, which lambdas may not capture
  PoseTable poses;
  const bool is_planar = pose.form == PoseForm::planar;
  const bool has_angles = is_planar || is_of_angles(pose.form);
  const Unit angle_unit = has_angles ? pose.columns.back().unit : angle_units[0];
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
  PoseRules rules{pose.form, {}};
  std::ranges::transform(pose.columns, std::back_inserter(rules.units), &UnitColumn::unit);
  std::optional<CsvTable> again;
  const NextRow next = [&](std::vector<double>& row) {
    if (!again) {
      again.emplace(open_table(path, options));
    }
    const bool has_row = again->next();
    row = has_row ? numbers_in(*again, pose.columns) : std::vector<double>();
    return has_row;
  };
  const auto refuse_again = [&](const std::string& why) { again->refuse("{}", why); };
  complete(rules, options, next, refuse_again, path.string());
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
    poses.understood.push_back(
        words_about(rules, fmt::format(", columns '{}' to '{}'",
                                       printable(table.columns()[pose.columns.front().index]),
                                       printable(table.columns()[pose.columns.back().index]))));
  }
  TableTimes times(table, time.value_or(UnitColumn()));
  std::uint64_t repeated = 0;
  std::uint64_t zeros = 0;
  const RefuseRow refuse_row = [&](const std::string& why) { table.refuse("{}", why); };
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
    const std::vector<double> v = numbers_in(table, pose.columns);
    if (is_planar) {
      const auto at = [&](std::size_t i) { return rules.units[i].convert(v[i]); };
      poses.T_robot_sensor.push_back(v.empty() ? unknown_pose : Pose{{at(0), at(1)}, at(2)});
    } else {
      poses.spatial.push_back(spatial_pose(rules, v, refuse_row));
      zeros += !v.empty() && !poses.spatial.back() ? 1 : 0;
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

PoseForm form_of_rows(const std::string& name, std::size_t width, const TableOptions& options) {
  const std::optional<PoseForm> form = form_of(width);
  if (!form) {
    refuse(name, "its poses are of {} numbers; {}", width, forms_of_poses);
  }
  if (form == PoseForm::euler && options.euler.empty()) {
    refuse(name,
           "its poses are x, y, z and three angles or a rotation vector; give `euler xyz`, roll, "
           "pitch and yaw about fixed axes, or other axes, or `euler vector`");
  }
  return options.euler == "vector" ? PoseForm::rotation_vector : *form;
}

PoseTable poses_of_rows(const std::string& name, std::span<const double> numbers, std::size_t width,
                        const TableOptions& options) {
  const PoseForm form = form_of_rows(name, width, options);
  PoseRules rules{form, units_of(form, options)};
  std::size_t end = 0;  // of the row
  const NextRow next = [&](std::vector<double>& row) {
    if (end == numbers.size()) {
      return false;
    }
    const auto part = numbers.subspan(end, width);
    end += width;
    const bool known = std::ranges::all_of(part, [](double v) { return std::isfinite(v); });
    row.assign(part.begin(), known ? part.end() : part.begin());
    return true;
  };
  const RefuseRow refuse_row = [&](const std::string& why) {
    refuse(fmt::format("{}[{}]", name, end / width - 1), "{}", why);
  };
  complete(rules, options, next, refuse_row, name);
  PoseTable poses;
  end = 0;
  for (std::vector<double> row; next(row);) {
    poses.spatial.push_back(spatial_pose(rules, row, refuse_row));
  }
  if (is_of_angles(form) || form == PoseForm::matrix) {
    poses.understood = {words_about(rules)};
  }
  return poses;
}

}  // namespace palpate
