#include "streaming/table_import.hpp"
#include "streaming/import_survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/recording_rules.hpp"
#include "io/table_columns.hpp"
#include "model/number_text.hpp"
#include "streaming/import_array.hpp"
#include "streaming/pose_join.hpp"
#include "streaming/touch_plane.hpp"

namespace palpate {

namespace {

/// Splits the text into `count` parts, the first of which may hold the separator itself; no parts
/// where there are fewer.
std::vector<std::string> split_last(std::string text, char separator, std::size_t count) {
  std::vector<std::string> parts;
  for (std::size_t at = text.npos; parts.size() + 1 < count; text.resize(at)) {
    at = text.rfind(separator);
    if (at == text.npos) {
      return {};
    }
    parts.insert(parts.begin(), text.substr(at + 1));
  }
  parts.insert(parts.begin(), text);
  return parts;
}

std::optional<Unit> unit_named(std::span<const Unit> units, const std::string& name) {
  const auto found = std::ranges::find(units, name, &Unit::name);
  return found == units.end() ? std::nullopt : std::optional(*found);
}

TableOptions table_options(const ImportOptions& options) {
  TableOptions table{.time_column = options.time_column,
                     .pressure_columns = options.pressure_columns};
  if (!options.time_unit.empty()) {
    table.time_unit = unit_named(time_units, options.time_unit);
    if (!table.time_unit) {
      refuse(fmt::format("`time-unit {}`", options.time_unit), "give s, ms, us or ns");
    }
  }
  if (!options.pose_unit.empty()) {
    const auto names = split_last(options.pose_unit, ',', 2);
    table.length_unit = names.empty() ? std::nullopt : unit_named(length_units, names[0]);
    table.angle_unit = names.empty() ? std::nullopt : unit_named(angle_units, names[1]);
    if (!table.length_unit || !table.angle_unit) {
      refuse(fmt::format("`pose-unit {}`", options.pose_unit),
             "give mm,rad or mm,deg or m,rad or m,deg");
    }
  }
  if (!options.pose_columns.empty()) {
    const bool in_space = std::ranges::count(options.pose_columns, ',') == 6;
    table.pose_columns = split_last(options.pose_columns, ',', in_space ? 7 : 3);
    if (table.pose_columns.empty()) {
      refuse(fmt::format("`pose-columns {}`", options.pose_columns),
             "give three names, X,Y,THETA, or seven, TX,TY,TZ,QX,QY,QZ,QW");
    }
    for (const char* part : {"qx", "qy", "qz", "qw"}) {
      if (!in_space && std::ranges::find(table.pose_columns, part) != table.pose_columns.end()) {
        refuse(fmt::format("`pose-columns {}`", options.pose_columns),
               "'{}' is a part of a quaternion, no angle; give TX,TY,TZ,QX,QY,QZ,QW", part);
      }
    }
  }
  return table;
}

/// Requires a pose of every touch.
void require_touch_poses(const ImportOptions& options, const ImportedRecording& imported) {
  const Recording& recording = imported.recording;
  if (options.poses.empty()) {
    refuse(options.pressures,
           "its rows are touches, and each needs a pose; give `poses{}`, or `unposed` where the "
           "poses are unknown, or for a stream of frames a column 'time' or `rate`",
           imported.holds_poses ? " " + options.pressures : "");
  }
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (!is_finite(recording.T_robot_sensor[i])) {
      refuse(options.poses,
             "has no pose for row {} of {}, counted from 0{}, and a touch needs one; add it, or "
             "give `rows frames`",
             i, options.pressures,
             recording.time_s.empty() ? "" : fmt::format(", at {} s", recording.time_s[i]));
    }
  }
}

/// True where a table of this name is given and has the column.
bool has_column(const std::string& path, const std::string& name) {
  return !path.empty() && CsvTable(path).find(name);
}

/// @param n rows
void choose_rows(const ImportOptions& options, std::size_t n, Recording& recording) {
  if (options.rate_hz) {
    if (!recording.time_s.empty()) {
      refuse(fmt::format("`rate {}`", *options.rate_hz), "{} has times; leave it out",
             options.pressures);
    }
    for (std::size_t i = 0; i < n; ++i) {
      recording.time_s.push_back(static_cast<double>(i) / *options.rate_hz);
    }
  }
  recording.rows = recording.time_s.empty() ? "touches" : "frames";
  if (options.rows.empty()) {
    return;
  }
  if (options.rows != "touches" && options.rows != "frames") {
    refuse(fmt::format("`rows {}`", options.rows), "give frames or touches");
  }
  if (options.rows == "frames" && recording.time_s.empty()) {
    refuse(options.pressures, "frames need times; add a column 'time', or give `rate`");
  }
  recording.rows = options.rows;
}

/// The label and the pose of `truth`, whose numbers are still in the units of the tables.
Truth truth_of(const std::string& text) {
  const auto parts = split_last(text, ',', 4);
  std::array<std::optional<double>, 3> pose;
  for (std::size_t i = 0; i < 3; ++i) {
    pose[i] = parts.empty() || parts[0].empty() ? std::nullopt : number_of(parts[i + 1]);
    if (!pose[i]) {
      refuse(fmt::format("`truth {}`", text), "give LABEL,X,Y,THETA, in the units of the poses");
    }
  }
  return {parts[0], {{*pose[0], *pose[1]}, *pose[2]}};
}

/// The pose of `truth` in mm and rad.
Pose truth_pose(const std::string& text, const Pose& in_units, const std::array<Unit, 3>& units) {
  const Pose pose{
      {units[0].convert(in_units.translation_mm.x), units[1].convert(in_units.translation_mm.y)},
      units[2].convert(in_units.theta_rad)};
  if (!is_robot_pose(pose)) {
    refuse(fmt::format("`truth {}`", text),
           "is further than {:g} mm or turned by more than 1e9 rad; check the numbers and "
           "their units, {}, {} and {}",
           farthest_mm, units[0].name, units[1].name, units[2].name);
  }
  return pose;
}

void check_numbers(const ImportOptions& options) {
  if (options.largest_gap_s &&
      !(*options.largest_gap_s > 0.0 && std::isfinite(*options.largest_gap_s))) {
    refuse(fmt::format("`largest-gap-s {}`", *options.largest_gap_s), "give seconds above 0");
  }
  constexpr double slowest_hz = 1e-3;
  constexpr double fastest_hz = 1e6;
  if (options.rate_hz && !(*options.rate_hz >= slowest_hz && *options.rate_hz <= fastest_hz)) {
    refuse(fmt::format("`rate {}`", *options.rate_hz), "give {} to {} Hz", slowest_hz, fastest_hz);
  }
  if (options.sign != 1 && options.sign != -1) {
    refuse(fmt::format("`sign {}`", options.sign), "give 1, or -1 where readings fall under load");
  }
  if (!std::isfinite(options.pose_delay_s)) {
    refuse(fmt::format("`pose-delay {}`", options.pose_delay_s), "give seconds");
  }
  if (options.unposed && !options.poses.empty()) {
    refuse("`unposed`", "{} holds the poses; leave one of them out", options.poses);
  }
}

/// The recording of rows that are read.
ImportedRecording recording_of(const ImportOptions& options, ArrayTable array, ImportRows rows) {
  const std::optional<glm::dvec3> normal = plane_normal(options.plane);
  auto& [pressures, poses, T_robot_object, elements] = rows;
  ImportedRecording imported;
  imported.holds_poses = pressures.holds_poses;
  Recording& recording = imported.recording;
  recording.pressure_unit = options.pressure_unit;
  recording.object = options.object;
  recording.elements_mm = std::move(array.elements_mm);
  recording.valid = std::move(array.valid);
  recording.baseline = std::move(array.baseline);
  recording.pressure = std::move(pressures.pressure);
  if (options.sign < 0) {
    std::ranges::transform(recording.baseline, recording.baseline.begin(), std::negate<>{});
    std::ranges::transform(recording.pressure, recording.pressure.begin(), std::negate<>{});
  }
  recording.time_s = std::move(pressures.time_s);
  recording.device_time_s = std::move(pressures.device_time_s);
  recording.lost_before = std::move(pressures.lost_before);
  ImportSurvey survey(recording.elements_mm.size(), recording.valid);
  survey.add(recording.pressure);
  imported.whole_up_to = recording.pressure_unit == "kPa" ? survey.whole_up_to() : std::nullopt;
  choose_rows(options, survey.rows(), recording);
  mark_unknown(options.pressures, survey, recording);
  if (poses) {
    if (poses->spatial.empty() && normal) {
      refuse(fmt::format("`plane {}`", options.plane),
             "is for poses in space; {} has x, y and theta", options.poses);
    }
    for (double& time_s : poses->time_s) {
      time_s -= options.pose_delay_s;  // to the clock of the frames
    }
    if (!poses->spatial.empty()) {
      const TouchPlane plane = touch_plane(poses->spatial, normal);
      imported.of_poses = take_into_plane(plane, survey, *poses, recording);
      if (T_robot_object) {
        recording.truth = Truth{options.object, inverse(plane.project(*T_robot_object))};
      }
    }
    if (!poses->left_out.empty()) {
      imported.of_poses.push_back(poses->left_out);
    }
    imported.assumed_units = poses->assumed_units;
    join(std::move(*poses), survey, options, imported);
  } else {
    const bool at_zero = options.unposed && recording.rows == "touches";
    recording.T_robot_sensor.assign(survey.rows(), at_zero ? Pose{} : unknown_pose);
  }
  if (recording.rows == "touches" && !options.unposed) {
    require_touch_poses(options, imported);
  }
  return imported;
}

}  // namespace

ImportedRecording import_tables(const ImportOptions& options) {
  const TableOptions columns = table_options(options);
  check_numbers(options);
  auto truth = options.truth.empty() ? std::nullopt : std::optional(truth_of(options.truth));
  ArrayTable array = import_array(options);
  if (!options.time_column.empty() && !has_column(options.pressures, options.time_column) &&
      !has_column(options.poses, options.time_column)) {
    refuse(fmt::format("`time-column {}`", options.time_column),
           "no table has this column; give its name");
  }
  ImportRows rows{.pressures =
                      read_pressures(options.pressures, array.elements_mm.size(), columns)};
  const Unit length_unit = columns.length_unit.value_or(length_units.front());
  std::array<Unit, 3> pose_units{length_unit, length_unit,
                                 columns.angle_unit.value_or(angle_units.front())};
  if (!options.poses.empty()) {
    // The rows of one file belong together, even where their times are equal.
    rows.poses = read_poses(options.poses, columns, !in_one_file(options));
    if (in_one_file(options) && options.pose_delay_s != 0.0 &&
        rows.pressures.time_s.size() == rows.poses->T_robot_sensor.size()) {
      rows.poses->time_s = rows.pressures.time_s;
    }
    if (rows.poses->time_s.empty() && options.pose_delay_s != 0.0) {
      refuse(fmt::format("`pose-delay {}`", options.pose_delay_s), "{} has no times; leave it out",
             options.poses);
    }
    pose_units = rows.poses->units;
  }
  ImportedRecording imported = recording_of(options, std::move(array), std::move(rows));
  if (truth) {
    truth->T_object_robot = truth_pose(options.truth, truth->T_object_robot, pose_units);
    imported.recording.truth = truth;
  }
  return imported;
}

void require_sound(const ImportOptions& options) {
  check_numbers(options);
  import_array(options);
}

ImportedRecording import_rows(const ImportOptions& options, ImportRows rows) {
  check_numbers(options);
  ArrayTable array = import_array(options);
  if (array.elements_mm.size() != rows.elements) {
    refuse(options.pressures,
           "has {} readings a frame for an array of {} elements; correct `array`", rows.elements,
           array.elements_mm.size());
  }
  return recording_of(options, std::move(array), std::move(rows));
}

}  // namespace palpate
