#include <algorithm>
#include <cctype>
#include <memory>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "io/recording_tables.hpp"
#include "palpate/files.hpp"

namespace palpate::cli {

namespace {

struct ExportArguments {
  std::string recording;
  std::string folder;
};

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
  std::string command = fmt::format("palpate import {} --array {} --poses {}",
                                    file("pressures.csv"), file("array.csv"), file("poses.csv"));
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

void export_tables(const ExportArguments& options) {
  if (const std::string format = read_format(options.recording); format != "palpate.recording") {
    refuse(options.recording, "format '{}' has no tables; give a recording", format);
  }
  const Recording recording = read_recording(options.recording);
  const std::filesystem::path folder = options.folder;
  CommandFiles files;
  files.reads("FILE", options.recording);
  for (const std::string& name : table_names()) {
    files.writes("-o", folder / name);
  }
  files.require_distinct();
  make_folder(folder);
  write_tables(folder, recording);
  fmt::print("{}: {} {} of {} elements", folder.string(), recording.size(), recording.rows,
             recording.elements());
  if (!recording.sensor.empty()) {
    fmt::print(", without the name of the sensor ({})", recording.sensor);
  }
  fmt::print("; back: {}\n", import_command(folder, recording));
}

}  // namespace

void add_export(CLI::App& app) {
  auto* command = app.add_subcommand(
      "export",
      "Write a recording as CSV tables: pressures.csv, poses.csv and array.csv. The command also "
      "prints the 'palpate import' that makes the same recording from them");
  const auto options = std::make_shared<ExportArguments>();
  command->add_option("FILE", options->recording, "Recording of touches or frames (HDF5)")
      ->required();
  command
      ->add_option("-o,--output", options->folder,
                   "Folder to write to; made where it is missing. Older tables are replaced")
      ->required();
  command->callback([options] { export_tables(*options); });
}

}  // namespace palpate::cli
