#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "learning/sensor_calibration.hpp"
#include "palpate/device.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// What is asked of a calibration, as a user says it.
struct CalibrationRequest {
  bool unposed = false;             ///< the recordings' poses do not count
  std::optional<double> threshold;  ///< in the recordings' pressure unit; none: learned
  std::optional<double> ratio;      ///< the same
  std::string layer = "auto";       ///< auto, mean_level or log_odds
  std::optional<int> levels;        ///< of readings; none: as default_tables() has them
  int max_maps = 5;                 ///< SensorCalibrationOptions::most_maps
  std::optional<RecognitionBins> bins;
  bool gives_bins = false;  ///< something was said of `bins`, though they may be none
};

/// A map to compare touches with, and its name for messages.
struct NamedMap {
  std::string name;
  OccupancyGrid map;
};

/// What calibrate_sensor() takes. Presses are views into the recordings.
struct CalibrationTask {
  std::vector<Press> presses;
  std::vector<OccupancyGrid> maps;
  SensorCalibrationOptions options;

  bool known_poses() const { return presses.front().T_object_robot.has_value(); }
};

/// Makes the task: where all touches of each recording are at one pose, poses count as unknown.
/// With the layer auto, touches at known poses are compared by the mean pressure; at unknown ones
/// both layers are tried, but without a mean level of every map only log odds.
/// @param recordings of touches of one pressure unit, at least one
/// @param touches [recording] to use, [begin, end)
/// @throws Error naming the flag or the recording, where a value is out of range, a recording names
/// no object, some recordings alone have poses, bins are given for unknown poses, or a map lacks
/// the mean level that it needs
CalibrationTask calibration_task(const CalibrationRequest& request,
                                 std::span<const Recording> recordings,
                                 std::span<const std::array<std::size_t, 2>> touches,
                                 std::span<const NamedMap> maps);

/// Adds to the result of calibrate_sensor() how far touches at known poses lie from their poses;
/// see learn_touch_sd().
void add_touch_sd(Device& device, const CalibrationTask& task, SensorCalibration& calibration,
                  const std::function<void(double)>& progress = {});

}  // namespace palpate
