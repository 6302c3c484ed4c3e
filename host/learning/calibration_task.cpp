#include "learning/calibration_task.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "learning/touch_sd_learning.hpp"

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
             "recordings have poses; calibrate from one kind, or give --unposed");
    }
  }
  return first;
}

std::vector<Press> presses_of(std::span<const Recording> recordings,
                              std::span<const std::array<std::size_t, 2>> touches, bool posed) {
  std::vector<Press> presses;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const Recording& recording = recordings[i];
    if (recording.object.empty()) {
      refuse(recording.path,
             "attribute 'object' is empty; a calibration needs to know what was touched");
    }
    for (std::size_t touch = touches[i][0]; touch < touches[i][1]; ++touch) {
      presses.push_back(posed ? posed_press(recording, touch) : single_press(recording, touch));
    }
  }
  return presses;
}

void check_numbers(const CalibrationRequest& request) {
  if (request.threshold && !(*request.threshold > 0.0 && std::isfinite(*request.threshold))) {
    refuse(fmt::format("--threshold {}", *request.threshold), "must be above 0");
  }
  if (request.ratio && !(*request.ratio >= 0.0)) {
    refuse(fmt::format("--ratio {}", *request.ratio), "must be at least 0");
  }
  if (request.ratio && *request.ratio >= 1.0) {
    refuse(fmt::format("--ratio {}", *request.ratio), "must be below 1");
  }
  constexpr auto most = static_cast<int>(most_reading_levels);
  if (request.levels && (*request.levels < 2 || *request.levels > most)) {
    refuse(fmt::format("--levels {}", *request.levels), "give 2 to {}", most);
  }
  if (request.layer != "auto" && request.layer != "mean_level" && request.layer != "log_odds") {
    refuse(fmt::format("--layer {}", request.layer), "give auto, mean_level or log_odds");
  }
  if (request.max_maps < 1) {
    refuse(fmt::format("--max-maps {}", request.max_maps), "give 1 or more");
  }
}

/// Those to try; at unknown poses, where a map lacks its mean level, the layer auto is log_odds.
std::vector<TableKind> tables_of(const CalibrationRequest& request, bool known_poses,
                                 std::span<const OccupancyGrid> maps) {
  const bool has_mean_levels =
      std::ranges::none_of(maps, [](const OccupancyGrid& map) { return map.mean_level.empty(); });
  std::vector<TableKind> tables;
  for (TableKind kind : default_tables(false)) {
    const bool of_pressure = kind.layer == MapLayer::mean_level;
    const bool tried = request.layer == "auto" ? (of_pressure ? has_mean_levels : !known_poses)
                                               : of_pressure == (request.layer == "mean_level");
    if (tried) {
      kind.levels = request.levels ? static_cast<std::size_t>(*request.levels) : kind.levels;
      tables.push_back(kind);
    }
  }
  return tables;
}

}  // namespace

CalibrationTask calibration_task(const CalibrationRequest& request,
                                 std::span<const Recording> recordings,
                                 std::span<const std::array<std::size_t, 2>> touches,
                                 std::span<const NamedMap> maps) {
  const bool known_poses = !request.unposed && all_have_poses(recordings);
  CalibrationTask task{.presses = presses_of(recordings, touches, known_poses)};
  const bool needs_mean_level =
      request.layer == "mean_level" || (request.layer == "auto" && known_poses);
  for (const NamedMap& given : maps) {
    if (needs_mean_level && given.map.mean_level.empty()) {
      refuse(given.name,
             "has no mean_level; build the map with palpate map --unposed or --sensor-model, or "
             "give --layer log_odds");
    }
    task.maps.push_back(given.map);
  }
  check_numbers(request);
  if (request.gives_bins && !known_poses) {
    throw Error(
        Fault::input,
        "--bins, --x-mm, --y-mm, --theta-deg and --pivot-mm are for touches at known poses; "
        "leave them out: where the others lie is found on bins one element wide");
  }
  task.options = {.pressure_unit = recordings.front().pressure_unit,
                  .threshold = request.threshold,
                  .ratio = request.ratio,
                  .tables = tables_of(request, known_poses, task.maps),
                  .most_maps = static_cast<std::size_t>(request.max_maps),
                  .bins = request.bins};
  return task;
}

void add_touch_sd(Device& device, const CalibrationTask& task, SensorCalibration& calibration,
                  const std::function<void(double)>& progress) {
  const std::optional<DisplacementSd> sd =
      learn_touch_sd(device, task.presses, calibration.sensor, calibration.maps, progress);
  calibration.touch_sd_fitted = sd.has_value();
  calibration.sensor.touch_sd = sd.value_or(DisplacementSd{});
}

}  // namespace palpate
