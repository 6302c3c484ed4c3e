#pragma once

#include <optional>
#include <string>

#include "palpate/touch_detector.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// The flags that say when a stream of frames is a touch.
struct DetectorFlags {
  std::optional<double> onset;
  std::optional<double> release;
  TouchDetectorOptions options;
};

void add_detector_flags(CLI::App& command, DetectorFlags& flags);

/// The detector's options for pressures of this unit: raw ones have no default onset, and the
/// release is by default half of the onset. `source` is named where a flag is missing.
TouchDetectorOptions detector_options(const DetectorFlags& flags, const std::string& pressure_unit,
                                      const std::string& source);

}  // namespace palpate::cli
