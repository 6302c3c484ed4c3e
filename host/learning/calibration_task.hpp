#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "learning/sensor_calibration.hpp"
#include "palpate/device.hpp"
#include "palpate/touch.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// What is asked of a calibration beside a Request's classifier, bins, region and frames, as a user
/// says it.
struct CalibrationRequest {
  bool unposed = false;        ///< the recordings' poses do not count
  std::string layer = "auto";  ///< auto, mean_level or log_odds
  std::optional<int> levels;   ///< of readings; none: as default_tables() has them
  int max_maps = 5;            ///< CalibrationSettings::most_maps
  std::string group;           ///< what is left out together, see grouped_object()
};

/// What calibrate_sensor() takes. Presses are views into the recordings.
struct CalibrationTask {
  std::vector<Press> presses;
  std::vector<OccupancyGrid> maps;
  CalibrationSettings options;

  bool known_poses() const { return presses.front().T_object_robot.has_value(); }
};

/// Makes the task: where all touches of each recording are at one pose, poses count as unknown.
/// With the layer auto, touches at known poses are compared by the mean pressure, on drawn maps by
/// log odds; at unknown ones both layers are tried, but without a mean level of every map only log
/// odds. On given maps, touches at known poses lie where the recording's truth says, or else where
/// the object was learned.
/// @param recognition what recognize will be given; its classifier, which is learned where it is
/// left out, bins, region and frames alone count
/// @param recordings of touches of one pressure unit, at least one
/// @param maps to compare touches with
/// @throws Error naming the option or the recording, where a value is out of range, a recording
/// names no object, some recordings alone have poses, bins are given for unknown poses, or a map
/// lacks the mean level that it needs
CalibrationTask calibration_task(const CalibrationRequest& request, const Request& recognition,
                                 std::span<const Recording> recordings,
                                 std::span<const GivenMap> maps);

}  // namespace palpate
