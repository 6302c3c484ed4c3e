#include "learning/sensor_calibration.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "options/option.hpp"
#include "palpate/occupancy_grid.hpp"
#include "recognition/recordings.hpp"

namespace palpate {

namespace {

/// Throws Error where some recordings have poses and others have none.
bool all_have_poses(std::span<const Recording> recordings) {
  const bool first = has_poses(recordings.front());
  for (const Recording& recording : recordings) {
    if (has_poses(recording) != first) {
      const Recording& without = first ? recording : recordings.front();
      refuse(without.path,
             "all touches are at one pose, so that their poses count as unknown, but other "
             "recordings have poses; calibrate from one kind, or give `unposed`");
    }
  }
  return first;
}

/// Where the object frame of a map lay when a recording was made: where the recording's truth says,
/// or else where it lay in the robot frame when the object was learned.
Pose pose_of(const Recording& recording, const OccupancyGrid& map) {
  return recording.truth ? in_centred_frame(map, recording.truth->T_object_robot)
                         : inverse(map.T_learned_robot_object);
}

std::vector<Press> presses_of(std::span<const Recording> recordings,
                              const std::optional<Frames>& frames, bool posed,
                              const std::string& group_by, std::span<const OccupancyGrid> given) {
  std::vector<Press> presses;
  for (const Recording& recording : recordings) {
    const bool by_truth = recording.object.empty() && recording.truth && !given.empty();
    const auto [object, group] = grouped_object(recording, group_by);
    const std::string& label = by_truth ? recording.truth->object : object;
    if (label.empty()) {
      refuse(recording.path,
             "attribute 'object' is empty; a calibration needs to know what was touched");
    }
    const auto map = std::ranges::find(given, label, &OccupancyGrid::label);
    const auto [begin, end] = selected_touches(recording, frames);
    for (std::size_t touch = begin; touch < end; ++touch) {
      presses.push_back(posed ? posed_press(recording, touch) : single_press(recording, touch));
      presses.back().label = label;
      presses.back().group = group;
      if (posed && map != given.end()) {
        presses.back().T_object_robot = pose_of(recording, *map) * *presses.back().T_object_robot;
      }
    }
  }
  return presses;
}

void check_numbers(const CalibrationRequest& request, const Request& recognition) {
  require_sound(recognition);
  if (recognition.threshold == 0.0) {
    refuse("`threshold 0`", "must be above 0");
  }
  constexpr auto limit = static_cast<int>(most_reading_levels);
  if (request.levels && (*request.levels < 2 || *request.levels > limit)) {
    refuse(fmt::format("`levels {}`", *request.levels), "give 2 to {}", limit);
  }
  if (request.layer != "auto" && request.layer != "mean_level" && request.layer != "log_odds") {
    refuse(fmt::format("`layer {}`", request.layer), "give auto, mean_level or log_odds");
  }
  if (request.max_maps < 1) {
    refuse(fmt::format("`max-maps {}`", request.max_maps), "give 1 or more");
  }
}

/// The tables to try. Where a map lacks its mean level, the layer auto is log_odds: by contact at
/// unknown poses, and at known ones, on drawn maps, by as many levels as mean pressures.
std::vector<TableKind> tables_of(const CalibrationRequest& request, bool known_poses,
                                 std::span<const OccupancyGrid> maps) {
  std::vector<TableKind> tables = default_tables(false);
  for (TableKind& kind : tables) {
    kind.levels = request.levels ? static_cast<std::size_t>(*request.levels) : kind.levels;
  }
  const TableKind& of_contact = tables.front();
  const TableKind& of_pressure = tables.back();
  const bool has_mean_levels =
      std::ranges::none_of(maps, [](const OccupancyGrid& map) { return map.mean_level.empty(); });
  if (request.layer == "auto" && has_mean_levels) {
    return known_poses ? std::vector{of_pressure} : tables;
  }
  if (request.layer == "auto" && known_poses) {
    return {{MapLayer::log_odds, of_pressure.levels}};
  }
  return {request.layer == "mean_level" ? of_pressure : of_contact};
}

}  // namespace

CalibrationTask calibration_task(const CalibrationRequest& request, const Request& recognition,
                                 std::span<const Recording> recordings,
                                 std::span<const GivenMap> maps) {
  const bool known_poses = !request.unposed && all_have_poses(recordings);
  CalibrationTask task;
  const bool needs_mean_level =
      request.layer == "mean_level" || (request.layer == "auto" && known_poses);
  for (const GivenMap& given : maps) {
    const OccupancyGrid& map = given.hypothesis.map;
    const bool has_enough = map.drawn && request.layer == "auto";
    if (needs_mean_level && map.mean_level.empty() && !has_enough) {
      refuse(given.name,
             "has no mean_level; build the map with `unposed` or `sensor-model`, or give "
             "`layer log_odds`");
    }
    task.maps.push_back(map);
  }
  task.presses = presses_of(recordings, recognition.frames, known_poses, request.group, task.maps);
  if (!request.group.empty() && std::ranges::all_of(task.presses, [&](const Press& press) {
        return press.group == task.presses.front().group;
      })) {
    refuse_option("group", request.group,
                  "all touches are of '{}'; give touches of two groups or more, or leave it out",
                  task.presses.front().group);
  }
  check_numbers(request, recognition);
  const bool gives_bins = recognition.bins || recognition.x_mm || recognition.y_mm ||
                          recognition.theta_deg || recognition.pivot_mm;
  if (gives_bins && !known_poses) {
    throw Error(
        Fault::input,
        "`bins`, `x-mm`, `y-mm`, `theta-deg` and `pivot-mm` are for touches at known poses; leave "
        "them out: touches at unknown poses are placed on bins one element wide");
  }
  ReadingOptions& readings = task.options.readings;
  readings.pressure_unit = recordings.front().pressure_unit;
  readings.threshold = recognition.threshold;
  readings.ratio = recognition.ratio;
  task.options.tables = tables_of(request, known_poses, task.maps);
  task.options.most_maps = static_cast<std::size_t>(request.max_maps);
  if (!infers_region(recognition)) {
    task.options.bins = {given_lattice(recognition), has_auto_pivot(recognition)};
  }
  return task;
}

}  // namespace palpate
