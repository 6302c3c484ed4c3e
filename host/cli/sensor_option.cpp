#include "cli/sensor_option.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "cli/options.hpp"
#include "io/input_file.hpp"
#include "palpate/driver.hpp"
#include "palpate/virtual_sensor.hpp"
#include "streaming/import_steps.hpp"

namespace palpate::cli {

void add_detector_flags(CLI::App& command, DetectorFlags& flags, const std::string& usual_drift) {
  TouchDetectorOptions& options = flags.options;
  command.add_option("--onset", flags.onset,
                     "A touch begins when the largest pressure above the baseline exceeds this "
                     "value, in the sensor's unit [default: 2 kPa; required for raw pressure]");
  command.add_option("--release", flags.release,
                     "A touch ends when the pressure falls below this [default: half of --onset]");
  add_with_default(command, "--steady", options.steady,
                   "Largest relative deviation of the summed pressure in a touch's steady phase");
  add_with_default(command, "--min-steady-s", options.min_steady_s,
                   "Shortest steady phase of a touch, s; shorter contacts are ignored");
  add_with_default(command, "--smooth-s", options.smooth_s,
                   "Time over which pressures are averaged before they are judged, s");
  command.add_option("--drift-s", flags.drift_s,
                     "Time longer than any press, s: what an element reads for so long is no press "
                     "but its rest, which may drift and is subtracted [default: " +
                         usual_drift + "]");
}

TouchDetectorOptions detector_options(const DetectorFlags& flags, const std::string& pressure_unit,
                                      const std::string& source) {
  TouchDetectorOptions options = flags.options;
  if (flags.onset) {
    options.onset = require_above("--onset", *flags.onset, 0.0);
  } else if (pressure_unit == "raw") {
    refuse(source, "pressure_unit = raw has no default onset; give --onset");
  }
  options.release = flags.release.value_or(options.onset / 2.0);
  options.drift_s = flags.drift_s.value_or(options.drift_s);
  const TouchDetector refuses(options, {}, {});  // before the sensor and files are opened
  return options;
}

namespace {

constexpr const char* sensor_help =
    "A board, by its name in 'palpate sensors' or the path of its profile; behind a colon which "
    "one, as in flexitac:/dev/ttyUSB0; - for frames of the array --array that another program "
    "writes to standard input, a line each: JSON as {\"time\": s since 1970, \"pressure\": [...]}, "
    "or CSV with the time before the readings; the time may be left out, and x_mm, y_mm and "
    "theta_rad of T_robot_sensor added; replay:FILE[,speed=F|max], which plays a recording of "
    "frames; or "
    "simulate:SHAPE[,rate=HZ][,array=COLUMNS:ROWS:PITCH_MM][,seed=N][,touches=N][,noise=KPA][,"
    "object=random|X_MM:Y_MM:DEG][,speed=F|max], which simulates a robot that presses an array "
    "onto a shape";

constexpr const char* poses_help =
    "File, FIFO or - (standard input) with the poses T_robot_sensor, one line of JSON each: "
    "{\"time\": s since 1970, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}; or CSV whose header "
    "has these names";

/// The flags that add_array_flags() adds.
constexpr const char* array_flags[] = {"--array", "--first-element", "--order",
                                       "--dead",  "--pressure-unit", "--sign"};

/// Standard input as a sensor.
std::unique_ptr<LineSensor> open_lines(const SensorArguments& arguments,
                                       const PosedSensor::Warn& warn) {
  if (arguments.lines.array.empty()) {
    refuse("--array",
           "missing; frames on standard input do not say where their elements lie: give "
           "COLUMNS:ROWS:PITCH or a file");
  }
  if (arguments.poses == "-") {
    refuse("--poses -",
           "standard input holds the frames of --sensor -; give the poses as a file or a FIFO, or "
           "x_mm, y_mm and theta_rad in the lines of the frames");
  }
  Recording array = import_array(arguments.lines);
  if (arguments.lines.sign < 0) {
    std::ranges::transform(array.baseline, array.baseline.begin(), std::negate<>{});
  }
  return std::make_unique<LineSensor>(
      SensorDescription{.name = "standard input",
                        .serial = {},
                        .pressure_unit = arguments.lines.pressure_unit,
                        .elements_mm = std::move(array.elements_mm),
                        .valid = std::move(array.valid),
                        .baseline = std::move(array.baseline)},
      warn, arguments.lines.sign);
}

}  // namespace

OpenSensor open_sensor(const SensorArguments& arguments, const PosedSensor::Warn& warn) {
  const std::string& name = arguments.sensor;
  OpenSensor opened;
  if (name == "-") {
    auto lines = open_lines(arguments, warn);
    opened.lines = lines.get();
    opened.sensor = std::move(lines);
  } else {
    opened.sensor = is_virtual_sensor(name) ? open_virtual_sensor(name) : open_board(name);
  }
  if (!arguments.poses.empty()) {
    auto posed = std::make_unique<PosedSensor>(std::move(opened.sensor), arguments.poses,
                                               PosedSensor::usual_gap_s, warn);
    opened.posed = posed.get();
    opened.sensor = std::move(posed);
  }
  return opened;
}

void add_sensor_files(const SensorArguments& arguments, CommandFiles& files) {
  const std::string& name = arguments.sensor;
  if (name == "-") {
    files.reads("--sensor", name, CommandFiles::Dash::stream);
    files.reads("--array", arguments.lines.array);
  } else if (const auto file =
                 is_virtual_sensor(name) ? virtual_sensor_file(name) : board_file(name)) {
    files.reads("--sensor", *file);
  }
  files.reads("--poses", arguments.poses, CommandFiles::Dash::stream);
}

void report_refused(const OpenSensor& opened) {
  const auto report = [](std::uint64_t lines, const char* of, const std::string& first) {
    if (lines > 0) {
      tell_on_stderr(fmt::format("{} lines of {} were skipped; the first: {}", lines, of, first));
    }
  };
  if (opened.lines != nullptr) {
    report(opened.lines->refused(), "frames", opened.lines->first_refused());
  }
  if (opened.posed == nullptr) {
    return;
  }
  const PosedSensor::Poses poses = opened.posed->poses();
  report(poses.refused, "poses", poses.first_refused);
  if (poses.set_back > 0) {
    tell_on_stderr("the clock of the poses was set back " +
                   (poses.set_back == 1 ? "once" : fmt::format("{} times", poses.set_back)));
  }
}

void add_sensor_flags(CLI::App& command, SensorArguments& arguments,
                      const std::string& poses_default) {
  add_required(command, "--sensor", arguments.sensor, sensor_help);
  command.add_option("--poses", arguments.poses, std::string(poses_help) + poses_default);
  add_array_flags(command, arguments.lines);
  for (const char* flag : array_flags) {
    command.get_option(flag)->group("Of --sensor -");
  }
  command.parse_complete_callback([&command, &arguments] {
    for (const char* flag : array_flags) {
      if (arguments.sensor != "-" && command.get_option(flag)->count() > 0) {
        refuse(flag,
               "is for --sensor -, frames on standard input; sensor {} has an array of its own",
               arguments.sensor);
      }
    }
  });
}

CLI::Option* add_array_flags(CLI::App& command, ImportOptions& options) {
  auto* array = command.add_option(
      "--array", options.array,
      "COLUMNS:ROWS:PITCH, a grid with its pitch in mm, centred about the sensor's origin; or a "
      "CSV file with a row 'x y' in mm for each element. Elements are counted in the order of "
      "their readings: of a grid row by row, where x grows along a row and y from row to row, "
      "unless the next two flags say otherwise");
  add_with_default(command, "--first-element", options.first_element,
                   "Corner of the grid whose element is read first, seen with x to the right and y "
                   "upwards: bottom-left, bottom-right, top-left or top-right");
  add_with_default(command, "--order", options.order,
                   "How the grid's elements follow each other: rows (along x first) or columns");
  command.add_option("--dead", options.dead,
                     "Elements that do not read, counted from 0 in the order of their readings, as "
                     "13,42 [default: in a log those without any reading; of a sensor none]");
  add_with_default(command, "--pressure-unit", options.pressure_unit,
                   "Unit of the pressures: kPa, or raw for readings of another unit");
  add_with_default(command, "--sign", options.sign,
                   "-1 where readings fall under load: they are stored times -1 and rise");
  return array;
}

}  // namespace palpate::cli
