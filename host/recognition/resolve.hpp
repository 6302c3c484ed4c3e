#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>

#include "palpate/device.hpp"
#include "recognition/recognition_task.hpp"
#include "recognition/request.hpp"

namespace palpate {

/// What a task follows from beside its request.
struct Circumstances {
  std::string pressure_unit;  ///< of the touches to come
  std::string source;         ///< that gives them, for messages
  double reach_mm = 0.0;      ///< of the largest array that touches; see array_reach_mm()
  /// Option that reads every bin, for which `auto` takes the histogram; "" where none does.
  std::string every_bin_for = {};
  /// Every touch is waited for: `auto` takes bounds for any number of bins, which tell sooner.
  bool waited_for = false;
  /// Counts of x, y and theta that were settled before, in the place of those that the request
  /// leaves open.
  std::optional<std::array<int, 3>> counts = {};
};

/// Gives the device that recognises, which may be opened only then.
using DeviceSource = std::function<Device&()>;

/// The task that a completed request asks for: the objects, the sensor, the region, whether
/// "(none)" is one of the objects, and the filter.
/// @param device asked for where counts of bins follow from its memory, and where maps of unlike
/// priors are built again
/// @throws Error where a file cannot be read, and naming the option, or the scene file and its key,
/// whose value cannot be meant
RecognitionTask resolve(const Request& request, const Circumstances& circumstances,
                        const DeviceSource& device = {});

}  // namespace palpate
