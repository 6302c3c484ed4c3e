#include "cli/detector_flags.hpp"

#include <CLI/CLI.hpp>

#include "io/input_file.hpp"

namespace palpate::cli {

void add_detector_flags(CLI::App& command, DetectorFlags& flags) {
  TouchDetectorOptions& options = flags.options;
  command.add_option("--onset", flags.onset,
                     "A touch begins when the largest pressure above the baseline exceeds this "
                     "value, in the sensor's unit [default: 2 kPa; required for raw pressure]");
  command.add_option("--release", flags.release,
                     "A touch ends when the pressure falls below this [default: half of --onset]");
  command
      .add_option("--steady", options.steady,
                  "Largest relative deviation of the summed pressure in a touch's steady phase")
      ->capture_default_str();
  command
      .add_option("--min-steady-s", options.min_steady_s,
                  "Shortest steady phase of a touch, s; shorter contacts are ignored")
      ->capture_default_str();
  command
      .add_option("--smooth-s", options.smooth_s,
                  "Time over which pressures are averaged before they are judged, s")
      ->capture_default_str();
  command
      .add_option("--drift-s", options.drift_s,
                  "Time constant, s, with which the baseline follows drift while nothing "
                  "touches the array; 0: the baseline is fixed")
      ->capture_default_str();
}

TouchDetectorOptions detector_options(const DetectorFlags& flags, const std::string& pressure_unit,
                                      const std::string& source) {
  TouchDetectorOptions options = flags.options;
  if (flags.onset) {
    options.onset = *flags.onset;
  } else if (pressure_unit == "raw") {
    refuse(source, "pressure_unit = raw has no default onset; give --onset");
  }
  options.release = flags.release.value_or(options.onset / 2.0);
  return options;
}

}  // namespace palpate::cli
