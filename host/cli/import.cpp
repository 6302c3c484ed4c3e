#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/sensor_option.hpp"
#include "cli/text_table.hpp"
#include "io/recording_rules.hpp"
#include "io/recording_survey.hpp"
#include "io/table_columns.hpp"
#include "model/printable.hpp"
#include "palpate/files.hpp"
#include "streaming/table_import.hpp"

namespace palpate::cli {

namespace {

struct ImportArguments : ImportOptions {
  std::string output;
  std::string split;
  std::uint64_t unlabelled = 0;  ///< rows that `split` leaves out: values_in() counts them
};

/// The command that takes the recording.
std::string next_command(const ImportArguments& options, const Recording& recording) {
  const bool raw = recording.pressure_unit == "raw";
  const char* unposed = options.unposed ? " --unposed" : "";
  if (recording.rows == "frames") {
    return !options.unposed && std::ranges::none_of(recording.T_robot_sensor, is_finite)
               ? fmt::format(
                     "palpate live --sensor replay:{} --poses POSES --maps MAPS/, or import again "
                     "with --poses, or with --unposed where they are unknown",
                     options.output)
               : fmt::format("palpate touches {} -o TOUCHES.h5{}{}", options.output, unposed,
                             raw ? " --onset P" : "");
  }
  const std::string threshold = raw ? " --threshold P" : "";
  return recording.object.empty()
             ? fmt::format("palpate recognize {} --maps MAPS/{}{}", options.output,
                           options.unposed ? " --each-frame" : "", threshold)
             : fmt::format("palpate map {} -o MAPS/{}{}", options.output, unposed, threshold);
}

void print_summary(const ImportArguments& options, const ImportedRecording& imported) {
  const Recording& r = imported.recording;
  fmt::print("{}: {} {} of {} elements", options.output, r.size(), r.rows, r.elements());
  if (!r.time_s.empty()) {
    fmt::print(" in {:.3f} s", r.time_s.back() - r.time_s.front());
  }
  if (r.rows == "frames") {
    fmt::print(", {} with a pose", std::ranges::count_if(r.T_robot_sensor, [](const Pose& pose) {
                 return !std::isnan(pose.theta_rad);
               }));
  }
  if (imported.in_gaps > 0) {
    fmt::print(
        ", {} without one as the poses around them are more than {:.3g} s apart (--largest-gap-s)",
        imported.in_gaps, imported.largest_gap_s);
  }
  std::size_t unknown = 0;
  for (std::size_t k = 0; k < r.pressure.size(); ++k) {
    const bool alive = r.valid.empty() || r.valid[k % r.valid.size()] != 0;
    unknown += !alive || std::isnan(r.pressure[k]) ? 1 : 0;
  }
  fmt::print("{}", also(unknown, "readings unknown or dead"));
  if (imported.holds_poses && options.poses.empty()) {
    fmt::print(", its columns of poses left out (--poses {})", options.pressures);
  }
  if (!imported.assumed_units.empty()) {
    fmt::print(", {}", imported.assumed_units);
  }
  if (imported.whole_up_to) {
    fmt::print(", readings are whole numbers up to {:.0f}: raw? (--pressure-unit raw)",
               *imported.whole_up_to);
  }
  fmt::print("; next: {}\n", next_command(options, r));
  std::ranges::for_each(imported.understood, tell_on_stderr);
  for (const SetupFinding& finding : r.findings) {
    tell_on_stderr(fmt::format("{}: {}", options.poses, finding.words));
  }
}

void write(const ImportArguments& options, const ImportedRecording& tables) {
  write_recording(options.output, tables.recording);
  print_summary(options, tables);
  if (tables.recording.rows == "touches") {
    if (const std::uint64_t repeated = survey_recording(options.output).repeated; repeated > 0) {
      tell_on_stderr(fmt::format(
          "{}: {} of {} touches equal an earlier one to the digit, and count as one with it",
          options.pressures, repeated, tables.recording.size()));
    }
  }
}

/// The values in the column that splits the rows, each once, in their order; 1 and 1.0 are one.
std::vector<std::string> values_in(ImportArguments& options) {
  constexpr std::size_t limit = 1000;
  validate(options);
  CsvTable table = open_table(options.pressures, options);
  const auto column = table.find_or_count(options.split);
  if (!column) {
    table.refuse_columns("`split {}`: no column is called so", options.split);
  }
  std::vector<std::string> values;
  while (table.next()) {
    const std::string_view text = table.text(*column);
    options.unlabelled += text.empty() ? 1 : 0;
    const auto is_same = [&](const std::string& value) { return table.holds(*column, value); };
    if (!text.empty() && std::ranges::none_of(values, is_same)) {
      values.emplace_back(text);
    }
    if (values.size() > limit) {
      table.refuse("`split {}`: the column has more than {} values; name a column of labels",
                   options.split, limit);
    }
  }
  return values;
}

/// Where the recording of a value goes: OUTPUT-VALUE.h5, without characters that a path may not
/// have.
std::string output_of(const std::string& output, std::string value) {
  std::ranges::replace_if(
      value, [](unsigned char c) { return c == '/' || c < ' '; }, '_');
  std::filesystem::path path(output);
  path.replace_filename(path.stem().string() + "-" + value + path.extension().string());
  return path.string();
}

/// The imports that are asked for: one, or one for each value of the column that splits the rows.
std::vector<ImportArguments> imports_of(ImportArguments options) {
  if (options.split.empty()) {
    return {options};
  }
  std::vector<ImportArguments> imports;
  for (const std::string& value : values_in(options)) {
    ImportArguments one = options;
    one.where.push_back(fmt::format("{}={}", options.split, value));
    one.output = output_of(options.output, value);
    one.object = options.object.empty() ? value : options.object;
    if (std::ranges::find(imports, one.output, &ImportArguments::output) != imports.end()) {
      refuse(options.pressures, "`split {}`: two values would be written to {}; rename one",
             options.split, one.output);
    }
    constexpr std::size_t longest_name = 255;  // of a file
    if (std::filesystem::path(one.output).filename().string().size() > longest_name) {
      refuse(options.pressures, "`split {}`: '{}...' is too long for a file's name; shorten it",
             options.split, printable(value.substr(0, 20)));
    }
    imports.push_back(std::move(one));
  }
  if (imports.empty()) {
    refuse(options.pressures, "`split {}`: no row has a value there; name a column of labels",
           options.split);
  }
  return imports;
}

/// All tables are read before any recording is written.
void import_tables(const ImportArguments& options) {
  std::vector<std::pair<ImportArguments, ImportedRecording>> all;
  for (const ImportArguments& one : imports_of(options)) {
    CommandFiles()
        .reads("PRESSURES", one.pressures)
        .reads("--poses", one.poses)
        .reads("--array", one.array)
        .writes("-o", one.output)
        .prepare();
    all.emplace_back(one, palpate::import_tables(one));
  }
  for (const auto& [one, tables] : all) {
    write(one, tables);
  }
  if (const std::uint64_t rows = all.front().first.unlabelled; rows > 0) {
    tell_on_stderr(fmt::format("{}: {} rows without a value of '{}' are left out (--split)",
                               options.pressures, rows, options.split));
  }
}

}  // namespace

void add_import(CLI::App& app) {
  const auto [command, options] = add_command<ImportArguments>(
      app, "import",
      "Write a recording (HDF5) from tables: pressures, poses and the positions of the elements. "
      "Tables are CSV files, with commas, semicolons, tabs or blanks between the cells. "
      "docs/files.md describes them",
      import_tables);
  add_required(*command, "PRESSURES", options->pressures,
               "CSV: a row for each frame or touch, with a column for each element (and time, "
               "where it is known); or a row for each reading, with the columns time, element "
               "(counted from 0) and pressure. An empty cell or NaN is an unknown reading; an "
               "element without any reading is dead");
  command->add_option("--poses", options->poses,
                      "CSV with the poses T_robot_sensor: columns x, y, theta (or yaw), or of "
                      "poses in space (see --pose-columns), and time. Frames take the pose "
                      "interpolated at their time; without a column time, rows are taken one by "
                      "one. It may be PRESSURES itself [default: frames without poses]");
  command->add_flag("--unposed", options->unposed,
                    "The sensor's poses are unknown: write rows that are touches at the pose 0, "
                    "for 'palpate map --unposed', 'palpate calibrate --unposed' and 'palpate "
                    "recognize --each-frame'; frames stay without poses");
  add_array_flags(*command, *options)->required();
  add_required(*command, "-o,--output", options->output, "Recording to write (HDF5)");
  command->add_option("--rows", options->rows,
                      "What a row of the pressures is: frames (a stream, of which 'palpate "
                      "touches' finds the touches) or touches (single presses, each with a pose or "
                      "--unposed) [default: frames where there are times, else touches]");
  command->add_option("--pose-unit", options->pose_unit,
                      "Units of the poses: mm,rad or mm,deg or m,rad or m,deg [default: by the "
                      "columns' names, as in x_m or theta_deg, else mm,rad]");
  command->add_option(
      "--time-unit", options->time_unit,
      "Unit of times whose column does not name it, as time_ns does: s, ms, us or ns [default: s]");
  command->add_option("--time-column", options->time_column,
                      "Name of the column of times, in both tables; a column without a name is "
                      "called by its number, from 1 [default: time, timestamp, stamp or t]");
  command->add_option("--header-line", options->header_line,
                      "Number of the line of PRESSURES that holds the columns' names, from 1 "
                      "[default: the first with as many cells as the rows]");
  command
      ->add_option("--where", options->where,
                   "COLUMN=VALUE: take only the rows in which the column is this, as those of one "
                   "sensor of several (a number is of PRESSURES); may be given more than once "
                   "[default: all rows]")
      ->allow_extra_args(false);
  command->add_option("--split", options->split,
                      "Write a recording for each value of this column, OUTPUT-VALUE.h5, labelled "
                      "by it unless --object is given");
  command->add_option("--pressure-columns", options->pressure_columns,
                      "Columns of the pressures, of their own table, separated by commas: names or "
                      "numbers from 1, FIRST:LAST, START::STEP (3::3, every third from the third "
                      "on), patterns (*_fz, or p{n}_fz in the order of the numbers) or a beginning "
                      "of names [default: all columns that are neither time nor pose]");
  command->add_option("--pressure-component", options->pressure_component,
                      "Of elements that read three axes, in three columns each: z, or norm, the "
                      "length of the vector [default: one column an element]");
  command->add_option(
      "--pose-columns", options->pose_columns,
      "Columns of the poses, of their own table, as --pressure-columns names them: X,Y,THETA; or "
      "in space X,Y,Z,ROLL,PITCH,YAW (see --euler), a rotation vector X,Y,Z,RX,RY,RZ, a quaternion "
      "TX,TY,TZ,QX,QY,QZ,QW, or the 12 or 16 numbers of a matrix [default: these names; "
      "actual_TCP_pose_0 to 5; O_T_EE_0 to 15]");
  command->add_option(
      "--euler", options->euler,
      "Axes about which three angles turn, in the order of their columns, or of columns called "
      "roll, pitch and yaw, which are about x, y and z: xyz, zyx and so on about "
      "fixed axes, ZYX and so on about moving ones, as SciPy has them; or vector, a rotation "
      "vector [default: xyz, of columns called rx, ry and rz a vector]");
  command->add_option(
      "--matrix", options->matrix,
      "How matrices are written: columns or rows [default: the one by which they are rotations]");
  command->add_option(
      "--mount", options->mount,
      "X,Y,Z,ROLL,PITCH,YAW: the array's pose in the frame whose poses are logged, such as the "
      "robot's flange, mm and degrees about fixed axes [default: the poses are the array's]");
  add_with_default(
      *command, "--plane", options->plane,
      "Plane of the touches, of poses in space: auto, the robot's xy plane or the plane across "
      "the array's mean direction; or its normal NX,NY,NZ in the robot frame");
  command->add_option(
      "--largest-gap-s", options->largest_gap_s,
      "Poses further apart in time than this are not interpolated: a frame between them has no "
      "pose, s [default: 2.5 times the median step of the poses' times, at least 0.1]");
  command->add_option("--pose-delay", options->pose_delay_s,
                      "How far the poses' clock is ahead of the readings' clock, s; subtracted "
                      "from the poses' times [default: 0]");
  command->add_option("--rate", options->rate_hz,
                      "Frames per second of pressures without times; the first frame is at 0 s");
  command->add_option("--object", options->object, "Label of the touched object");
  command->add_option("--truth", options->truth,
                      "True identity and pose T_object_robot of the object, LABEL,X,Y,THETA in the "
                      "units of the poses, else of --pose-unit");
}

}  // namespace palpate::cli
