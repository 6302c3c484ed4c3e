#pragma once

#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "palpate/pose_track.hpp"
#include "palpate/sensor.hpp"
#include "palpate/touch_detector.hpp"
#include "streaming/line_sensor.hpp"
#include "streaming/table_import.hpp"

namespace palpate::cli {

/// The flags of the touch detector; `onset` and `release` have defaults that depend on the unit,
/// `drift_s` on the command.
struct DetectorFlags {
  std::optional<double> onset;
  std::optional<double> release;
  std::optional<double> drift_s;
  TouchDetectorOptions options;
};

/// @param usual_drift what stands for --drift-s where it is not given, for its help
void add_detector_flags(CLI::App& command, DetectorFlags& flags, const std::string& usual_drift);

/// The detector's options for pressures of this unit; the release is by default half of the onset.
/// Throws Error naming `source` where the pressures are raw and --onset is missing.
TouchDetectorOptions detector_options(const DetectorFlags& flags, const std::string& pressure_unit,
                                      const std::string& source);

/// What --sensor, --poses and the flags of the array say.
struct SensorArguments {
  std::string sensor;
  std::string poses;
  ImportOptions lines;  ///< the array of --sensor -, and the unit of its pressures
};

/// Adds --sensor, --poses and the flags of the array.
/// @param poses_default what is said of the poses of a sensor without --poses; may be ""
void add_sensor_flags(CLI::App& command, SensorArguments& arguments,
                      const std::string& poses_default);
/// Adds --array, --first-element, --order, --dead and --pressure-unit.
/// @return --array
CLI::Option* add_array_flags(CLI::App& command, ImportOptions& options);

/// A sensor; `posed` and `lines` are parts of it where --poses gives its poses and --sensor - its
/// frames, else null.
struct OpenSensor {
  std::unique_ptr<Sensor> sensor;
  const PosedSensor* posed = nullptr;
  const LineSensor* lines = nullptr;
};
/// Opens a board, a replay, a simulation or standard input, with the poses of --poses if it is
/// given.
/// @param warn see PosedSensor and LineSensor
/// @throws Error naming the flag, and what may be given instead
OpenSensor open_sensor(const SensorArguments& arguments, const PosedSensor::Warn& warn);

/// Adds the files that the sensor reads.
void add_sensor_files(const SensorArguments& arguments, CommandFiles& files);
/// Warns on standard error of skipped lines and of clocks that were set back.
void report_refused(const OpenSensor& opened);

}  // namespace palpate::cli
