#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "array_table.hpp"
#include "command_files.hpp"
#include "commands.hpp"
#include "npy_file.hpp"
#include "number_text.hpp"
#include "options.hpp"
#include "palpate/files.hpp"
#include "palpate/pose_track.hpp"
#include "pose_table.hpp"
#include "pressure_table.hpp"

namespace palpate::cli {

namespace {

struct Options {
  std::string pressures;
  std::string poses;
  std::string array;
  std::string output;
  std::string pressure_unit = "kPa";
  std::string pose_unit;
  std::string time_unit;
  std::string time_column;
  std::string pressure_columns;
  std::string pose_columns;
  double largest_gap_s = PosedSensor::usual_gap_s;
  std::optional<double> rate_hz;
  std::string rows;
  std::string object;
  std::string truth;
};

/// Splits the text into `count` parts, the first of which may hold the separator itself.
std::vector<std::string> split_last(std::string text, char separator, std::size_t count) {
  std::vector<std::string> parts;
  for (std::size_t at = text.npos; parts.size() + 1 < count; text.resize(at)) {
    at = text.rfind(separator);
    if (at == text.npos) {
      return {};
    }
    parts.insert(parts.begin(), text.substr(at + 1));
  }
  parts.insert(parts.begin(), text);
  return parts;
}

std::optional<Unit> unit_named(std::span<const Unit> units, const std::string& name) {
  const auto found = std::ranges::find(units, name, &Unit::name);
  return found == units.end() ? std::nullopt : std::optional(*found);
}

TableOptions table_options(const Options& options) {
  TableOptions table{.time_column = options.time_column,
                     .pressure_columns = options.pressure_columns};
  if (!options.time_unit.empty()) {
    table.time_unit = unit_named(time_units, options.time_unit);
    if (!table.time_unit) {
      refuse_flag("--time-unit", options.time_unit, "give s, ms, us or ns");
    }
  }
  if (!options.pose_unit.empty()) {
    const auto names = split_last(options.pose_unit, ',', 2);
    table.length_unit = names.empty() ? std::nullopt : unit_named(length_units, names[0]);
    table.angle_unit = names.empty() ? std::nullopt : unit_named(angle_units, names[1]);
    if (!table.length_unit || !table.angle_unit) {
      refuse_flag("--pose-unit", options.pose_unit, "give mm,rad or mm,deg or m,rad or m,deg");
    }
  }
  if (!options.pose_columns.empty()) {
    const auto names = split_last(options.pose_columns, ',', 3);
    if (names.empty()) {
      refuse_flag("--pose-columns", options.pose_columns, "give three names, X,Y,THETA");
    }
    std::ranges::copy(names, table.pose_columns.begin());
  }
  return table;
}

/// The array of --array: a grid, or a file.
struct Array : ArrayTable {
  std::size_t columns = 0;  ///< 0: not a grid
  std::size_t rows = 0;
};

Array array_of(const std::string& text) {
  const auto parts = split_last(text, ':', 3);
  const auto columns = parts.empty() ? std::nullopt : whole_number_of(parts[0]);
  if (!columns) {
    return {read_array(text)};
  }
  constexpr std::int64_t most = 1024;
  const auto rows = whole_number_of(parts[1]);
  const auto pitch_mm = number_of(parts[2]);
  if (*columns < 1 || *columns > most || !rows || *rows < 1 || *rows > most || !pitch_mm ||
      *pitch_mm < 1e-3 || *pitch_mm > 1e3) {
    refuse_flag("--array", text,
                "give COLUMNS:ROWS:PITCH, with 1 to {} columns and rows and a pitch of 0.001 to "
                "1000 mm, or a file",
                most);
  }
  Array array;
  array.columns = static_cast<std::size_t>(*columns);
  array.rows = static_cast<std::size_t>(*rows);
  array.elements_mm = grid_array(static_cast<int>(*columns), static_cast<int>(*rows), *pitch_mm);
  return array;
}

PressureTable read_npy_pressures(const std::string& path, const Array& array) {
  NpyArray npy = read_npy(path);
  const std::size_t elements = array.elements_mm.size();
  const auto& shape = npy.shape;
  const bool fits = (shape.size() == 2 && shape[1] == elements) ||
                    (shape.size() == 3 && shape[1] * shape[2] == elements &&
                     (array.columns == 0 || shape[2] == array.columns));
  if (!fits || shape[0] == 0) {
    refuse(path, "has the shape ({}); save [n, {}]{}, n at least 1, or correct --array",
           fmt::format("{}", fmt::join(shape, ", ")), elements,
           array.columns == 0 ? "" : fmt::format(" or [n, {}, {}]", array.rows, array.columns));
  }
  const auto infinite = std::ranges::find_if(npy.values, [](double p) { return std::isinf(p); });
  if (infinite != npy.values.end()) {
    const auto at = static_cast<std::size_t>(infinite - npy.values.begin());
    refuse(path, "row {}, element {} = {}; save finite numbers, or NaN where a reading is unknown",
           at / elements, at % elements, *infinite);
  }
  return {.pressure = std::move(npy.values)};
}

/// Marks as dead the elements without any reading. In touches, which have no unknown readings, it
/// also marks single readings.
void mark_unknown(const std::string& path, Recording& recording) {
  const std::size_t e = recording.elements_mm.size();
  std::vector<std::uint8_t> read(e, 0);
  bool some_unknown = false;
  for (std::size_t k = 0; k < recording.pressure.size(); ++k) {
    read[k % e] |= std::isnan(recording.pressure[k]) ? 0 : 1;
  }
  for (std::size_t i = 0; i < e; ++i) {
    read[i] = recording.valid.empty() ? read[i] : read[i] & recording.valid[i];
  }
  if (std::ranges::count(read, 0) == static_cast<std::ptrdiff_t>(e)) {
    refuse(path, "holds no reading of a living element; write the pressures");
  }
  for (std::size_t k = 0; k < recording.pressure.size(); ++k) {
    some_unknown = some_unknown || (read[k % e] != 0 && std::isnan(recording.pressure[k]));
  }
  if (!recording.valid.empty() || std::ranges::count(read, 0) > 0) {
    recording.valid = read;
  }
  if (some_unknown && recording.rows == "touches") {
    recording.valid.resize(recording.pressure.size());
    for (std::size_t k = 0; k < recording.pressure.size(); ++k) {
      recording.valid[k] = std::isnan(recording.pressure[k]) ? 0 : read[k % e];
    }
  }
}

std::vector<Pose> poses_by_time(const PoseTable& poses, const std::vector<double>& time_s,
                                double largest_gap_s) {
  PoseTrack track(largest_gap_s);
  for (std::size_t i = 0; i < poses.time_s.size(); ++i) {
    if (!std::isnan(poses.T_robot_sensor[i].theta_rad)) {
      track.add(poses.time_s[i], poses.T_robot_sensor[i]);
    }
  }
  track.end();
  std::vector<Pose> joined;
  joined.reserve(time_s.size());
  for (const double time : time_s) {
    joined.push_back(track.at(time).value_or(unknown_pose));
  }
  return joined;
}

/// Gives every row its pose, by time or row by row.
void join(PoseTable poses, const Options& options, Recording& recording) {
  const std::size_t n = recording.pressure.size() / recording.elements_mm.size();
  const bool same_rows = poses.time_s.empty() || options.poses == options.pressures;
  if (!same_rows && recording.time_s.empty()) {
    refuse(options.poses,
           "has times, {} has none; give both a column 'time' or neither, or give the frames' "
           "--rate",
           options.pressures);
  }
  if (!same_rows) {
    recording.T_robot_sensor = poses_by_time(poses, recording.time_s, options.largest_gap_s);
    return;
  }
  if (poses.T_robot_sensor.size() != n) {
    refuse(options.poses,
           "holds {} poses without a time for {} rows of {}; write one for each row, or give both "
           "a column 'time'",
           poses.T_robot_sensor.size(), n, options.pressures);
  }
  recording.T_robot_sensor = std::move(poses.T_robot_sensor);
}

/// Requires a pose of every touch.
void require_touch_poses(const Options& options, const Recording& recording) {
  if (options.poses.empty()) {
    refuse(options.pressures,
           "its rows are touches, and each needs a pose; give --poses, or for a stream of frames a "
           "column 'time' or --rate");
  }
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (std::isnan(recording.T_robot_sensor[i].theta_rad)) {
      refuse(options.poses,
             "has no pose for row {} of {}, counted from 0{}, and a touch needs one; add it, or "
             "give --rows frames",
             i, options.pressures,
             recording.time_s.empty() ? "" : fmt::format(", at {} s", recording.time_s[i]));
    }
  }
}

void choose_rows(const Options& options, Recording& recording) {
  const std::size_t n = recording.pressure.size() / recording.elements_mm.size();
  if (options.rate_hz) {
    require_above("--rate", *options.rate_hz, 0.0);
    if (!recording.time_s.empty()) {
      refuse_flag("--rate", *options.rate_hz, "{} has times; leave the flag out",
                  options.pressures);
    }
    for (std::size_t i = 0; i < n; ++i) {
      recording.time_s.push_back(static_cast<double>(i) / *options.rate_hz);
    }
  }
  recording.rows = recording.time_s.empty() ? "touches" : "frames";
  if (options.rows.empty()) {
    return;
  }
  if (options.rows != "touches" && options.rows != "frames") {
    refuse_flag("--rows", options.rows, "give frames or touches");
  }
  if (options.rows == "frames" && recording.time_s.empty()) {
    refuse(options.pressures, "frames need times; add a column 'time', or give --rate");
  }
  recording.rows = options.rows;
}

Truth truth_of(const std::string& text, const TableOptions& units) {
  const auto parts = split_last(text, ',', 4);
  std::array<std::optional<double>, 3> pose;
  for (std::size_t i = 0; i < 3; ++i) {
    pose[i] = parts.empty() ? std::nullopt : number_of(parts[i + 1]);
    if (!pose[i]) {
      refuse_flag("--truth", text, "give LABEL,X,Y,THETA, in the units of --pose-unit");
    }
  }
  const Unit length = units.length_unit.value_or(length_units.front());
  const Unit angle = units.angle_unit.value_or(angle_units.front());
  return {parts[0],
          {{length.convert(*pose[0]), length.convert(*pose[1])}, angle.convert(*pose[2])}};
}

/// The command that takes the recording.
std::string next_command(const Options& options, const Recording& recording) {
  const bool raw = recording.pressure_unit == "raw";
  if (recording.rows == "frames") {
    return options.poses.empty()
               ? fmt::format("import it with --poses, for the poses of its touches")
               : fmt::format("palpate touches {} -o TOUCHES.h5{}", options.output,
                             raw ? " --onset P" : "");
  }
  const std::string threshold = raw ? " --threshold P" : "";
  return recording.object.empty()
             ? fmt::format("palpate recognize {} --maps MAPS/{}", options.output, threshold)
             : fmt::format("palpate map {} -o MAPS/{}", options.output, threshold);
}

void print_summary(const Options& options, const Recording& r, bool assumed_units) {
  fmt::print("{}: {} {} of {} elements", options.output, r.size(), r.rows, r.elements());
  if (!r.time_s.empty()) {
    fmt::print(" in {:.3f} s", r.time_s.back() - r.time_s.front());
  }
  if (r.rows == "frames") {
    fmt::print(", {} with a pose", std::ranges::count_if(r.T_robot_sensor, [](const Pose& pose) {
                 return !std::isnan(pose.theta_rad);
               }));
  }
  std::size_t unknown = 0;
  for (std::size_t k = 0; k < r.pressure.size(); ++k) {
    const bool alive = r.valid.empty() || r.valid[k % r.valid.size()] != 0;
    unknown += !alive || std::isnan(r.pressure[k]) ? 1 : 0;
  }
  if (unknown > 0) {
    fmt::print(", {} readings unknown or dead", unknown);
  }
  if (assumed_units) {
    fmt::print(", poses taken to be in mm and rad");
  }
  fmt::print("; next: {}\n", next_command(options, r));
}

void import_tables(const Options& options) {
  const TableOptions tables = table_options(options);
  require_above("--largest-gap-s", options.largest_gap_s, 0.0);
  if (options.pressure_unit != "kPa" && options.pressure_unit != "raw") {
    refuse_flag("--pressure-unit", options.pressure_unit, "give kPa or raw");
  }
  CommandFiles files;
  files.reads("PRESSURES", options.pressures);
  if (!options.poses.empty()) {
    files.reads("--poses", options.poses);
  }
  files.reads("--array", options.array);
  files.writes("-o", options.output);
  files.require_distinct();
  require_writable(options.output);

  Recording recording;
  recording.object = options.object;
  recording.pressure_unit = options.pressure_unit;
  if (!options.truth.empty()) {
    recording.truth = truth_of(options.truth, tables);
  }
  Array array = array_of(options.array);
  PressureTable pressures =
      is_npy(options.pressures)
          ? read_npy_pressures(options.pressures, array)
          : read_pressures(options.pressures, array.elements_mm.size(), tables);
  recording.elements_mm = std::move(array.elements_mm);
  recording.valid = std::move(array.valid);
  recording.baseline = std::move(array.baseline);
  recording.pressure = std::move(pressures.pressure);
  recording.time_s = std::move(pressures.time_s);
  recording.device_time_s = std::move(pressures.device_time_s);
  recording.lost_before = std::move(pressures.lost_before);
  choose_rows(options, recording);
  mark_unknown(options.pressures, recording);
  bool assumed_units = false;
  if (options.poses.empty()) {
    recording.T_robot_sensor.assign(recording.pressure.size() / recording.elements_mm.size(),
                                    unknown_pose);
  } else {
    PoseTable poses = read_poses(options.poses, tables);
    assumed_units = poses.assumed_units;
    join(std::move(poses), options, recording);
  }
  if (recording.rows == "touches") {
    require_touch_poses(options, recording);
  }
  write_recording(options.output, recording);
  print_summary(options, recording, assumed_units);
}

}  // namespace

void add_import(CLI::App& app) {
  auto* command = app.add_subcommand(
      "import",
      "Write a recording (HDF5) from tables: pressures, poses and the positions of the elements. "
      "Tables are CSV files, with commas, semicolons, tabs or blanks between the cells; the "
      "pressures may also be an array of numpy.save. docs/files.md describes them");
  const auto options = std::make_shared<Options>();
  command
      ->add_option("PRESSURES", options->pressures,
                   "CSV: a row for each frame or touch, with a column for each element (and time, "
                   "where it is known); or a row for each reading, with the columns time, element "
                   "(counted from 0) and pressure. NPY: [n, elements] or [n, rows, columns]. An "
                   "empty cell or NaN is an unknown reading; an element without any reading is "
                   "dead")
      ->required();
  command->add_option(
      "--poses", options->poses,
      "CSV with the poses T_robot_sensor: columns x, y, theta (or yaw) and time. Frames take the "
      "pose interpolated at their time; without a column time, rows are taken one by one. It may "
      "be PRESSURES itself [default: frames without poses]");
  command
      ->add_option("--array", options->array,
                   "COLUMNS:ROWS:PITCH, a grid with its pitch in mm, centred about the sensor's "
                   "origin; or a CSV file with a row 'x y' in mm for each element. Elements are "
                   "counted row by row: x grows along a row, y from row to row")
      ->required();
  command->add_option("-o,--output", options->output, "Recording to write (HDF5)")->required();
  command->add_option(
      "--rows", options->rows,
      "What a row of the pressures is: frames (a stream, of which 'palpate touches' "
      "finds the touches) or touches (single presses, each with a pose) [default: "
      "frames where there are times, else touches]");
  command
      ->add_option("--pressure-unit", options->pressure_unit,
                   "Unit of the pressures: kPa, or raw for readings of another unit")
      ->capture_default_str();
  command->add_option(
      "--pose-unit", options->pose_unit,
      "Units of the poses: mm,rad or mm,deg or m,rad or m,deg [default: by the columns' names, as "
      "in x_m or theta_deg, else mm,rad]");
  command->add_option("--time-unit", options->time_unit,
                      "Unit of the times: s, ms, us or ns [default: by the column's name, as in "
                      "time_ns, else s]");
  command->add_option("--time-column", options->time_column,
                      "Name of the column of times, in both tables; a column without a name is "
                      "called by its number, from 1 [default: time, timestamp, stamp or t]");
  command->add_option("--pressure-columns", options->pressure_columns,
                      "Columns of the pressures: a prefix of their names, or FIRST:LAST [default: "
                      "all columns that are neither time nor pose]");
  command->add_option("--pose-columns", options->pose_columns,
                      "Names of the columns of the poses, X,Y,THETA [default: x,y,theta]");
  command
      ->add_option("--largest-gap-s", options->largest_gap_s,
                   "Poses further apart in time than this are not interpolated: a frame between "
                   "them has no pose, s")
      ->capture_default_str();
  command->add_option("--rate", options->rate_hz,
                      "Frames per second of pressures without times; the first frame is at 0 s");
  command->add_option("--object", options->object, "Label of the touched object");
  command->add_option("--truth", options->truth,
                      "True identity and pose T_object_robot of the object, LABEL,X,Y,THETA in the "
                      "units of --pose-unit");
  command->callback([options] { import_tables(*options); });
}

}  // namespace palpate::cli
