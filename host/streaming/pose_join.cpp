#include "streaming/import_steps.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "palpate/pose_track.hpp"
#include "streaming/press_clock.hpp"

namespace palpate {

namespace {

constexpr double day_s = 86400.0;

/// Drops the poses that are unknown.
void keep_known(PoseTable& poses) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < poses.time_s.size(); ++i) {
    if (is_finite(poses.T_robot_sensor[i])) {
      poses.time_s[kept] = poses.time_s[i];
      if (!poses.height_mm.empty()) {
        poses.height_mm[kept] = poses.height_mm[i];
      }
      poses.T_robot_sensor[kept++] = poses.T_robot_sensor[i];
    }
  }
  poses.time_s.resize(kept);
  poses.T_robot_sensor.resize(kept);
  poses.height_mm.resize(std::min(kept, poses.height_mm.size()));
}

/// A gap that a regular log does not reach when its steps jitter or a single pose is lost.
double usual_gap_s(const std::vector<double>& time_s) {
  constexpr double steps = 2.5;
  if (time_s.size() < 2) {
    return PosedSensor::usual_gap_s;
  }
  std::vector<double> step_s(time_s.size());
  std::adjacent_difference(time_s.begin(), time_s.end(), step_s.begin());
  step_s.erase(step_s.begin());
  const auto median = step_s.begin() + static_cast<std::ptrdiff_t>(step_s.size() / 2);
  std::ranges::nth_element(step_s, median);
  return std::max(PosedSensor::usual_gap_s, steps * *median);
}

/// Gives every frame the pose interpolated at its time.
void join_by_time(const PoseTable& poses, ImportedRecording& imported) {
  Recording& recording = imported.recording;
  PoseTrack track(imported.largest_gap_s);
  for (std::size_t i = 0; i < poses.time_s.size(); ++i) {
    track.add(poses.time_s[i], poses.T_robot_sensor[i]);
  }
  track.end();
  recording.T_robot_sensor.reserve(recording.time_s.size());
  for (const double time_s : recording.time_s) {
    const std::optional<Pose> pose = track.at(time_s);
    recording.T_robot_sensor.push_back(pose.value_or(unknown_pose));
    imported.in_gaps +=
        !pose && time_s > poses.time_s.front() && time_s < poses.time_s.back() ? 1 : 0;
  }
}

/// Adds the finding "clock" where presses and poses show it.
void find_clock(const PoseTable& poses, const ImportSurvey& survey, const ImportOptions& options,
                ImportedRecording& imported) {
  Recording& recording = imported.recording;
  if (recording.rows != "frames") {
    return;
  }
  const std::vector<double>& time_s = poses.time_s.empty() ? recording.time_s : poses.time_s;
  const PoseLog log{.time_s = time_s,
                    .T_robot_sensor = poses.T_robot_sensor,
                    .height_mm = poses.height_mm,
                    .largest_gap_s = options.largest_gap_s.value_or(usual_gap_s(time_s))};
  if (const auto offset =
          clock_offset(recording.time_s, survey.load, log, array_reach_mm(recording.elements_mm))) {
    recording.findings.push_back(clock_finding(*offset, options.pose_delay_s));
  }
}

/// Drops the poses that are unknown, where they have times.
void require_times(const ImportOptions& options, const Recording& recording, PoseTable& poses) {
  if (poses.time_s.empty()) {
    return;
  }
  if (recording.time_s.empty()) {
    refuse(options.poses,
           "has times, {} has none; give both a column 'time' or neither, or give the frames' "
           "`rate`",
           options.pressures);
  }
  keep_known(poses);
  if (poses.time_s.empty()) {
    refuse(options.poses, "holds no pose; write x, y and theta where they are known");
  }
}

constexpr double between_s = 10.0;

/// The times of a table, and where they step back.
struct TableClock {
  const std::string& path;
  std::vector<double>& time_s;
  const std::vector<ClockStep>& steps;

  /// The times of the stretch, from 0 on.
  std::span<double> stretch(std::size_t k) const {
    const std::size_t begin = k == 0 ? 0 : steps[k - 1].row;
    const std::size_t end = k == steps.size() ? time_s.size() : steps[k].row;
    return std::span(time_s).subspan(begin, end - begin);
  }
};

}  // namespace

bool in_one_file(const ImportOptions& options) {
  const auto poses = identity_of(std::filesystem::path(options.poses));
  return poses && poses == identity_of(std::filesystem::path(options.pressures));
}

void join(PoseTable poses, const ImportSurvey& survey, const ImportOptions& options,
          ImportedRecording& imported) {
  Recording& recording = imported.recording;
  const std::size_t n = survey.rows();
  require_times(options, recording, poses);
  if (!poses.time_s.empty()) {
    find_clock(poses, survey, options, imported);
    imported.largest_gap_s = options.largest_gap_s.value_or(usual_gap_s(poses.time_s));
    join_by_time(poses, imported);
    if (std::ranges::none_of(recording.T_robot_sensor, is_finite)) {
      const auto clock = std::ranges::find(recording.findings, "clock", &SetupFinding::what);
      const double days = std::round((poses.time_s.front() - recording.time_s.front()) / day_s);
      refuse(options.poses,
             "no row of {} finds a pose: its times are {} to {} s, the poses' are {} to {} s; {}",
             options.pressures, recording.time_s.front(), recording.time_s.back(),
             poses.time_s.front(), poses.time_s.back(),
             clock != recording.findings.end() ? clock->words
             : std::abs(days) == 1.0
                 ? fmt::format("where midnight lies between them, give `pose-delay {:.0f}`",
                               options.pose_delay_s + days * day_s)
                 : "check clocks and units, or raise `largest-gap-s`");
    }
    return;
  }
  if (poses.T_robot_sensor.size() != n) {
    refuse(
        options.poses,
        "holds {} poses without a time for {} frames or touches of {}; write a table with one for "
        "each, or give both a column 'time', or name it by `time-column`",
        poses.T_robot_sensor.size(), n, options.pressures);
  }
  find_clock(poses, survey, options, imported);
  recording.T_robot_sensor = std::move(poses.T_robot_sensor);
}

std::vector<std::string> lay_out_stretches(const ImportOptions& options, PressureTable& pressures,
                                           std::optional<PoseTable>& poses) {
  std::vector<TableClock> clocks{{options.pressures, pressures.time_s, pressures.steps}};
  if (poses && !poses->time_s.empty()) {
    clocks.push_back({options.poses, poses->time_s, poses->steps});
  }
  // Rows that are not sorted step back more often than a clock is set.
  constexpr std::size_t most_steps = 10;
  for (const TableClock& clock : clocks) {
    for (const TableClock& other : clocks) {
      if (clock.steps.size() > std::min(most_steps, other.steps.size())) {
        const ClockStep& step = clock.steps.front();
        refuse(fmt::format("{}:{}", clock.path, step.line),
               "{} s is earlier than the row before, at {} s, and {}; sort the rows by time",
               step.to_s, step.from_s,
               clock.steps.size() > most_steps
                   ? fmt::format("so are more than {} rows", most_steps)
                   : fmt::format("the clock of {} does not step back with it", other.path));
      }
    }
  }
  std::string lines;
  for (std::size_t k = 1; k <= pressures.steps.size(); ++k) {
    double end_s = clocks[0].stretch(k - 1).back();
    double begin_s = clocks[0].stretch(k).front();
    for (const TableClock& clock : clocks) {
      end_s = std::max(end_s, clock.stretch(k - 1).back());
      begin_s = std::min(begin_s, clock.stretch(k).front());
    }
    for (const TableClock& clock : clocks) {
      for (double& time_s : clock.stretch(k)) {
        time_s += end_s + between_s - begin_s;
      }
    }
    lines += fmt::format("{}{}", k == 1 ? "" : ", ", pressures.steps[k - 1].line);
  }
  if (pressures.steps.empty()) {
    return {};
  }
  const ClockStep& step = pressures.steps.front();
  return {fmt::format(
      "{}:{}: the clock steps back from {} to {} s{}; a new stretch begins there, {} s after the "
      "last",
      options.pressures, step.line, step.from_s, step.to_s,
      pressures.steps.size() == 1
          ? ""
          : fmt::format(", as at lines {} ({} times)", lines, pressures.steps.size()),
      between_s)};
}

}  // namespace palpate
