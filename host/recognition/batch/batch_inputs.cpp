#include "recognition/batch/batch_inputs.hpp"

#include <glob.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "io/csv_table.hpp"
#include "io/input_file.hpp"
#include "model/printable.hpp"
#include "recognition/option_text.hpp"

namespace palpate {

namespace {

namespace fs = std::filesystem;

std::optional<std::size_t> require_columns(const CsvTable& table) {
  constexpr const char* remedy =
      "name the columns path, frames (A:B, may be left out) and label (may be left out)";
  for (const std::string& column : table.columns()) {
    if (!alike(column, "path") && !alike(column, "frames") && !alike(column, "label")) {
      refuse(table.path(), "column '{}' is not known to a manifest; {}", printable(column), remedy);
    }
  }
  const std::optional<std::size_t> path = table.find("path");
  if (!table.has_header() || !path) {
    refuse(table.path(), "column 'path' is missing; {}", remedy);
  }
  return path;
}

void read_manifest(const fs::path& manifest, std::vector<BatchInput>& inputs) {
  CsvTable table(manifest);
  const std::optional<std::size_t> path = require_columns(table);
  const std::optional<std::size_t> frames = table.find("frames");
  const std::optional<std::size_t> label = table.find("label");
  while (table.next()) {
    BatchInput input;
    if (table.text(*path).empty()) {
      table.refuse("column 'path' is empty; name a recording");
    }
    input.path = (manifest.parent_path() / fs::path(table.text(*path))).string();
    if (frames && !table.text(*frames).empty()) {
      try {
        read_option("column 'frames':", std::string(table.text(*frames)), input.frames);
      } catch (const Error& error) {
        table.refuse("{}", error.what());
      }
    }
    if (label) {
      input.label = table.text(*label);
    }
    inputs.push_back(std::move(input));
  }
}

void read_folder(const fs::path& folder, std::vector<BatchInput>& inputs) {
  std::error_code error;
  const fs::directory_iterator entries(folder, error);
  if (error) {
    refuse(folder, "cannot be read: {}; check its permissions", error.message());
  }
  std::vector<std::string> paths;
  for (const auto& entry : entries) {
    const fs::path& path = entry.path();
    if (path.extension() == ".h5" && path.stem().extension() != ".map") {
      paths.push_back(path.string());
    }
  }
  if (paths.empty()) {
    refuse(folder, "a folder without recordings (*.h5); give another one");
  }
  std::ranges::sort(paths);
  for (std::string& path : paths) {
    inputs.push_back({std::move(path), {}, {}});
  }
}

/// For a pattern that the shell has left alone, such as one of more files than a command line
/// holds.
void read_pattern(const std::string& pattern, std::vector<BatchInput>& inputs) {
  glob_t found{};
  if (::glob(pattern.c_str(), 0, nullptr, &found) != 0) {
    ::globfree(&found);
    refuse(pattern, "no file matches; give recordings, a folder of them or a manifest");
  }
  for (std::size_t i = 0; i < found.gl_pathc; ++i) {
    inputs.push_back({found.gl_pathv[i], {}, {}});
  }
  ::globfree(&found);
}

}  // namespace

std::vector<BatchInput> list_inputs(std::span<const std::string> arguments) {
  std::vector<BatchInput> inputs;
  for (const std::string& argument : arguments) {
    std::error_code ignored;
    if (fs::is_directory(argument, ignored)) {
      read_folder(argument, inputs);
    } else if (alike(fs::path(argument).extension().string(), ".csv")) {
      read_manifest(argument, inputs);
    } else if (argument.find_first_of("*?[") != argument.npos && !fs::exists(argument, ignored)) {
      read_pattern(argument, inputs);
    } else {
      inputs.push_back({argument, {}, {}});
    }
  }
  if (inputs.empty()) {
    refuse(arguments.front(), "names no recording; write a row for each");
  }
  return inputs;
}

}  // namespace palpate
