#include "detector_flags.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "palpate/error.hpp"

namespace palpate::cli {

void add_detector_flags(CLI::App& command, DetectorFlags& flags) {
  TouchDetectorOptions& options = flags.options;
  command.add_option("--onset", flags.onset,
                     "A touch begins where the largest pressure above the baseline exceeds this, "
                     "in the sensor's unit [default: 2 kPa]");
  command.add_option("--release", flags.release,
                     "and ends where it falls below this [default: half of --onset]");
  command
      .add_option("--steady", options.steady,
                  "In the steady phase the summed pressure stays within this part of its mean")
      ->capture_default_str();
  command
      .add_option("--min-steady-s", options.min_steady_s,
                  "A shorter steady phase is no touch, in seconds")
      ->capture_default_str();
  command
      .add_option("--smooth-s", options.smooth_s,
                  "Onset, release and steadiness are judged by the mean over this time, in seconds")
      ->capture_default_str();
  command
      .add_option("--drift-s", options.drift_s,
                  "Time constant, in seconds, with which the baseline follows drift while nothing "
                  "is touched; 0: never")
      ->capture_default_str();
}

TouchDetectorOptions detector_options(const DetectorFlags& flags, const std::string& pressure_unit,
                                      const std::string& source) {
  TouchDetectorOptions options = flags.options;
  if (flags.onset) {
    options.onset = *flags.onset;
  } else if (pressure_unit == "raw") {
    throw Error(Fault::input,
                fmt::format("{}: pressure_unit = raw has no default onset; give --onset", source));
  }
  options.release = flags.release.value_or(options.onset / 2.0);
  return options;
}

}  // namespace palpate::cli
