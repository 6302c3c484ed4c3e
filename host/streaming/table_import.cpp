#include "streaming/table_import.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "io/recording_rules.hpp"
#include "model/number_text.hpp"
#include "streaming/import_steps.hpp"

namespace palpate {

namespace {

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

/// The label and the numbers of `truth`.
std::pair<std::string, std::array<double, 3>> truth_parts(const std::string& text) {
  std::string label = text;  // which may hold commas itself
  std::array<double, 3> pose{};
  for (std::size_t i = pose.size(); i-- > 0;) {
    const std::size_t comma = label.rfind(',');
    const auto number =
        comma == label.npos || comma == 0 ? std::nullopt : number_of(label.substr(comma + 1));
    if (!number) {
      refuse(fmt::format("`truth {}`", text), "give LABEL,X,Y,THETA, in the units of the poses");
    }
    pose[i] = *number;
    label.resize(comma);
  }
  return {label, pose};
}

/// The label and the pose of `truth`, whose numbers are in these units of x, y and theta.
Truth truth_of(const std::string& text, const std::array<Unit, 3>& units) {
  const auto [label, pose] = truth_parts(text);
  const Pose T_object_robot{{units[0].convert(pose[0]), units[1].convert(pose[1])},
                            units[2].convert(pose[2])};
  if (!is_robot_pose(T_object_robot)) {
    refuse(fmt::format("`truth {}`", text),
           "is further than {:g} mm or turned by more than 1e9 rad; check the numbers and "
           "their units, {}, {} and {}",
           farthest_mm, units[0].name, units[1].name, units[2].name);
  }
  return {label, T_object_robot};
}

void check(const ImportOptions& options) {
  validate(options);
  const auto require = [](bool holds, const std::string& option, const std::string& remedy) {
    if (!holds) {
      refuse(fmt::format("`{}`", option), "{}", remedy);
    }
  };
  const double gap_s = options.largest_gap_s.value_or(1.0);
  require(gap_s > 0.0 && std::isfinite(gap_s), fmt::format("largest-gap-s {}", gap_s),
          "give seconds above 0");
  const double rate_hz = options.rate_hz.value_or(1.0);
  require(rate_hz >= 1e-3 && rate_hz <= 1e6, fmt::format("rate {}", rate_hz),
          "give 0.001 to 1000000 Hz");
  require(options.sign == 1 || options.sign == -1, fmt::format("sign {}", options.sign),
          "give 1, or -1 where readings fall under load");
  require(std::isfinite(options.pose_delay_s), fmt::format("pose-delay {}", options.pose_delay_s),
          "give seconds");
  for (const auto& [option, value] : {std::pair<std::string, std::string>{"mount ", options.mount},
                                      {"euler ", options.euler},
                                      {"matrix ", options.matrix},
                                      {"pose-columns ", options.pose_columns}}) {
    require(value.empty() || !options.poses.empty(), option + value, "is for poses; give `poses`");
  }
  require(!options.unposed || options.poses.empty(), "unposed",
          options.poses + " holds the poses; leave one of them out");
  if (!options.truth.empty()) {
    truth_parts(options.truth);  // how far it is depends on the units of the poses' table
  }
}

/// The pose of `mount`; none where it is not given.
std::optional<SpatialPose> mount_of(const std::string& text) {
  if (text.empty()) {
    return {};
  }
  const auto parts = split_text(text, ',');
  std::array<double, 6> numbers{};
  bool are_numbers = parts.size() == numbers.size();
  for (std::size_t i = 0; i < numbers.size() && are_numbers; ++i) {
    const auto number = number_of(parts[i]);
    are_numbers = number.has_value() && std::abs(*number) <= farthest_mm;
    numbers[i] = (i < 3 ? length_units[0] : angle_units[1]).convert(number.value_or(0.0));
  }
  if (!are_numbers) {
    refuse(fmt::format("`mount {}`", text),
           "give X,Y,Z,ROLL,PITCH,YAW, the array's pose in the frame whose poses are given, in mm "
           "and degrees about fixed axes");
  }
  return SpatialPose{{numbers[0], numbers[1], numbers[2]},
                     rotation_of_angles("xyz", std::span(numbers).subspan(3))};
}

/// Takes poses of a frame to those of the array that is mounted in it.
void mount_array(const SpatialPose& mount, PoseTable& poses) {
  for (const Pose& pose : poses.T_robot_sensor) {
    poses.spatial.push_back(
        is_finite(pose)
            ? std::optional(SpatialPose{{pose.translation_mm.x, pose.translation_mm.y, 0.0},
                                        rotation_of_vector({0.0, 0.0, pose.theta_rad})})
            : std::nullopt);
  }
  poses.T_robot_sensor.clear();
  for (std::optional<SpatialPose>& pose : poses.spatial) {
    pose = pose ? std::optional(*pose * mount) : std::nullopt;
  }
}

/// The recording of rows that are read.
ImportedRecording recording_of(const ImportOptions& options, Recording array, ImportRows rows) {
  const std::optional<glm::dvec3> normal = plane_normal(options.plane);
  const std::optional<SpatialPose> mount = mount_of(options.mount);
  auto& [pressures, poses, T_robot_object, elements] = rows;
  ImportedRecording imported;
  const auto say = [&](const std::string& file, const std::vector<std::string>& words) {
    for (const std::string& sentence : words) {
      imported.understood.push_back(fmt::format("{}: {}", file, sentence));
    }
  };
  say(options.pressures, pressures.understood);
  const std::vector<std::string> stretches = lay_out_stretches(options, pressures, poses);
  imported.understood.insert(imported.understood.end(), stretches.begin(), stretches.end());
  imported.holds_poses = pressures.holds_poses;
  Recording& recording = imported.recording;
  recording = std::move(array);
  recording.pressure_unit = options.pressure_unit;
  recording.object = options.object;
  recording.pressure = std::move(pressures.pressure);
  if (options.sign < 0) {
    std::ranges::transform(recording.baseline, recording.baseline.begin(), std::negate<>{});
    std::ranges::transform(recording.pressure, recording.pressure.begin(), std::negate<>{});
  }
  recording.time_s = std::move(pressures.time_s);
  recording.device_time_s = std::move(pressures.device_time_s);
  recording.lost_before = std::move(pressures.lost_before);
  const ImportSurvey survey = survey_of(recording);
  imported.whole_up_to = recording.pressure_unit == "kPa" ? survey.whole_up_to : std::nullopt;
  choose_rows(options, survey.rows(), recording);
  mark_unknown(options.pressures, survey, recording);
  if (poses) {
    if (mount) {
      mount_array(*mount, *poses);
    }
    if (poses->spatial.empty() && normal) {
      refuse(fmt::format("`plane {}`", options.plane),
             "is for poses in space; {} has x, y and theta", options.poses);
    }
    for (double& time_s : poses->time_s) {
      time_s -= options.pose_delay_s;  // to the clock of the frames
    }
    if (!poses->spatial.empty()) {
      say(options.poses, take_into_plane(normal, T_robot_object, survey, *poses, recording));
    }
    say(options.poses, poses->understood);
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
  check(options);
  Recording array = import_array(options);
  const bool one_file = in_one_file(options);
  const auto require_column = [&](const std::string& option, const std::string& name) {
    const CsvTable pressures(options.pressures, options.header_line);
    if (!pressures.find_or_count(name) &&
        (one_file || options.poses.empty() || !CsvTable(options.poses).find_or_count(name))) {
      pressures.refuse_columns("`{}`: no table has this column; give its name", option);
    }
  };
  if (!options.time_column.empty()) {
    require_column("time-column " + options.time_column, options.time_column);
  }
  for (const auto& [name, value] : conditions(options)) {
    require_column(fmt::format("where {}={}", name, value), name);
  }
  // The poses may have a table of their own, with other columns and another header.
  TableOptions of_pressures = options;
  of_pressures.grid = grid_size(options);
  of_pressures.has_blocks = options.rows == "frames";
  of_pressures.is_one_of_two = !one_file && !options.poses.empty();
  TableOptions of_poses = of_pressures;
  if (!one_file) {
    of_pressures.pose_columns = of_pressures.pose_unit = "";
    of_poses.header_line = std::nullopt;
    std::erase_if(of_poses.where, [](const std::string& where) {  // by number, of PRESSURES
      return whole_number_of(where.substr(0, where.find('='))).has_value();
    });
  }
  // Poses without times belong to the rows one by one.
  of_pressures.keeps_repeated =
      one_file || options.rows == "touches" ||
      (!options.poses.empty() && !find_time(open_table(options.poses, of_poses), of_poses));
  ImportRows rows{.pressures =
                      read_pressures(options.pressures, array.elements_mm.size(), of_pressures)};
  const Unit length_unit = given_unit(options, length_units).value_or(length_units.front());
  std::array<Unit, 3> pose_units{length_unit, length_unit,
                                 given_unit(options, angle_units).value_or(angle_units.front())};
  if (!options.poses.empty()) {
    // The rows of one file belong together, even where their times are equal, but for those of
    // single readings.
    of_poses.needs_times = !one_file && !rows.pressures.time_s.empty();
    rows.poses = read_poses(options.poses, of_poses, !one_file || rows.pressures.is_long);
    if (one_file && options.pose_delay_s != 0.0 &&
        rows.pressures.time_s.size() ==
            rows.poses->T_robot_sensor.size() + rows.poses->spatial.size()) {
      rows.poses->time_s = rows.pressures.time_s;
      rows.poses->steps = rows.pressures.steps;
    }
    if (rows.poses->time_s.empty() && options.pose_delay_s != 0.0) {
      refuse(fmt::format("`pose-delay {}`", options.pose_delay_s), "{} has no times; leave it out",
             options.poses);
    }
    pose_units = rows.poses->units;
  }
  ImportedRecording imported = recording_of(options, std::move(array), std::move(rows));
  if (!options.truth.empty()) {
    imported.recording.truth = truth_of(options.truth, pose_units);
  }
  return imported;
}

void require_sound(const ImportOptions& options, std::size_t pose_numbers) {
  check(options);
  import_array(options);
  if (pose_numbers > 0) {
    form_of_rows(options.poses, pose_numbers, options);
  }
}

ImportedRecording import_rows(const ImportOptions& options, ImportRows rows) {
  check(options);
  Recording array = import_array(options);
  if (array.elements_mm.size() != rows.elements) {
    refuse(options.pressures,
           "has {} readings a frame for an array of {} elements; correct `array`", rows.elements,
           array.elements_mm.size());
  }
  return recording_of(options, std::move(array), std::move(rows));
}

}  // namespace palpate
