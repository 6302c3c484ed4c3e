#pragma once

#include <optional>
#include <string>

#include "palpate/touch_detector.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// The flags of the touch detector; `onset` and `release` have defaults that depend on the unit.
struct DetectorFlags {
  std::optional<double> onset;
  std::optional<double> release;
  TouchDetectorOptions options;
};

void add_detector_flags(CLI::App& command, DetectorFlags& flags);

/// The detector's options for pressures of this unit; the release is by default half of the onset.
/// Throws Error naming `source` where the pressures are raw and --onset is missing.
TouchDetectorOptions detector_options(const DetectorFlags& flags, const std::string& pressure_unit,
                                      const std::string& source);

}  // namespace palpate::cli
