#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "io/atomic_file.hpp"
#include "io/input_file.hpp"
#include "palpate/files.hpp"

namespace palpate::cli {

namespace {

struct ExportArguments {
  std::string recording;
  std::string folder;
};

constexpr const char* pressures_name = "pressures.csv";
constexpr const char* array_name = "array.csv";
constexpr const char* poses_name = "poses.csv";

/// A column of a table; a value that is not finite is an empty cell.
struct Column {
  std::string name;
  std::function<double(std::size_t row)> value;
};

/// Writes a CSV file, whose numbers have as many digits as needed; it appears once it is committed.
std::unique_ptr<AtomicFile> csv_file(const std::filesystem::path& path,
                                     const std::vector<Column>& columns, std::size_t rows) {
  constexpr std::size_t piece = 1 << 20;
  auto file = std::make_unique<AtomicFile>(path);
  std::string text;
  for (const Column& column : columns) {
    text.append(text.empty() ? "" : ",").append(column.name);
  }
  text += '\n';
  for (std::size_t row = 0; row < rows; ++row) {
    for (const Column& column : columns) {
      if (&column != &columns.front()) {
        text += ',';
      }
      if (const double value = column.value(row); std::isfinite(value)) {
        fmt::format_to(std::back_inserter(text), "{}", value);
      }
    }
    text += '\n';
    if (text.size() >= piece) {
      file->append(text);
      text.clear();
    }
  }
  file->append(text);
  return file;
}

std::vector<Column> pressure_columns(const Recording& r) {
  const std::size_t e = r.elements();
  std::vector<Column> columns;
  if (!r.time_s.empty()) {
    columns.push_back({"time", [&r](std::size_t row) { return r.time_s[row]; }});
  }
  if (!r.device_time_s.empty()) {
    columns.push_back({"device_time", [&r](std::size_t row) { return r.device_time_s[row]; }});
  }
  if (!r.lost_before.empty()) {
    columns.push_back(
        {"lost_before", [&r](std::size_t row) { return static_cast<double>(r.lost_before[row]); }});
  }
  const bool valid_by_row = r.valid.size() > e;
  for (std::size_t i = 0; i < e; ++i) {
    columns.push_back({fmt::format("p{}", i), [=, &r](std::size_t row) {
                         const std::size_t k = row * e + i;
                         return valid_by_row && r.valid[k] == 0 ? std::nan("") : r.pressure[k];
                       }});
  }
  return columns;
}

std::vector<Column> pose_columns(const Recording& r) {
  return {{"x_mm", [&r](std::size_t row) { return r.T_robot_sensor[row].translation_mm.x; }},
          {"y_mm", [&r](std::size_t row) { return r.T_robot_sensor[row].translation_mm.y; }},
          {"theta_rad", [&r](std::size_t row) { return r.T_robot_sensor[row].theta_rad; }}};
}

std::vector<Column> array_columns(const Recording& r) {
  std::vector<Column> columns{{"x_mm", [&r](std::size_t i) { return r.elements_mm[i].x; }},
                              {"y_mm", [&r](std::size_t i) { return r.elements_mm[i].y; }}};
  if (r.valid.size() == r.elements()) {
    columns.push_back({"valid", [&r](std::size_t i) { return r.valid[i] != 0 ? 1.0 : 0.0; }});
  }
  if (!r.baseline.empty()) {
    columns.push_back({"baseline", [&r](std::size_t i) { return r.baseline[i]; }});
  }
  return columns;
}

/// The text as one word of a shell.
std::string shell_word(const std::string& text) {
  const bool plain = std::ranges::all_of(text, [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("._-/,+=:").find(c) != std::string_view::npos;
  });
  if (plain) {
    return text;
  }
  std::string word = "'";
  for (const char c : text) {
    word += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return word + "'";
}

/// The command that makes the recording from its tables.
std::string import_command(const std::filesystem::path& folder, const Recording& r) {
  const auto file = [&](const char* name) { return shell_word((folder / name).string()); };
  std::string command = fmt::format("palpate import {} --array {} --poses {}", file(pressures_name),
                                    file(array_name), file(poses_name));
  command += fmt::format(" --rows {} --pressure-unit {}", r.rows, r.pressure_unit);
  if (!r.object.empty()) {
    command += " " + shell_word("--object=" + r.object);
  }
  if (r.truth && !r.truth->object.empty()) {  // --truth needs a label
    const Pose& T = r.truth->T_object_robot;
    command += " " + shell_word(fmt::format("--truth={},{},{},{}", r.truth->object,
                                            T.translation_mm.x, T.translation_mm.y, T.theta_rad));
  }
  return command + " -o FILE.h5";
}

/// Writes a recording as CSV files from which `palpate import` makes the same recording. Numbers
/// have as many digits as float64 needs; unknown readings and poses are empty cells, single dead
/// readings too. The files appear when all of them are written.
void export_tables(const ExportArguments& options) {
  if (const std::string format = read_format(options.recording); format != "palpate.recording") {
    refuse(options.recording, "format '{}' has no tables; give a recording", format);
  }
  const Recording recording = read_recording(options.recording);
  if (recording.elements_mm.size() != recording.elements()) {
    refuse(recording.path,
           "dataset 'elements' changes from row to row, which tables cannot hold; read the file "
           "with h5py");
  }
  const std::filesystem::path folder = options.folder;
  CommandFiles files;
  files.reads("FILE", options.recording);
  for (const char* name : {pressures_name, array_name, poses_name}) {
    files.writes("-o", folder / name);
  }
  files.require_distinct();
  make_folder(folder);
  for (const auto& file :
       {csv_file(folder / pressures_name, pressure_columns(recording), recording.size()),
        csv_file(folder / array_name, array_columns(recording), recording.elements()),
        csv_file(folder / poses_name, pose_columns(recording), recording.size())}) {
    file->commit();
  }
  fmt::print("{}: {} {} of {} elements", folder.string(), recording.size(), recording.rows,
             recording.elements());
  if (!recording.sensor.empty()) {
    fmt::print(", without the name of the sensor ({})", recording.sensor);
  }
  fmt::print("; back: {}\n", import_command(folder, recording));
}

}  // namespace

void add_export(CLI::App& app) {
  const auto [command, options] = add_command<ExportArguments>(
      app, "export",
      "Write a recording as CSV tables: pressures.csv, poses.csv and array.csv. The command also "
      "prints the 'palpate import' that makes the same recording from them",
      export_tables);
  add_required(*command, "FILE", options->recording, "Recording of touches or frames (HDF5)");
  add_required(*command, "-o,--output", options->folder,
               "Folder to write to; made where it is missing. Older tables are replaced");
}

}  // namespace palpate::cli
