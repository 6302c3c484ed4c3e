#include "recognition/batch/input_reading.hpp"

#include <glob.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <system_error>
#include <thread>

#include <tbb/task_arena.h>

#include "estimation/parallel_for.hpp"
#include "io/csv_table.hpp"
#include "io/input_file.hpp"
#include "model/printable.hpp"
#include "options/option.hpp"
#include "palpate/files.hpp"

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

void read_manifest(const fs::path& manifest, std::vector<BatchEntry>& inputs) {
  CsvTable table(manifest);
  const std::optional<std::size_t> path = require_columns(table);
  const std::optional<std::size_t> frames = table.find("frames");
  const std::optional<std::size_t> label = table.find("label");
  while (table.next()) {
    BatchEntry input;
    if (table.text(*path).empty()) {
      table.refuse("column 'path' is empty; name a recording");
    }
    input.path = (manifest.parent_path() / fs::path(table.text(*path))).string();
    if (frames && !table.text(*frames).empty()) {
      try {
        input.frames = parse_frames("column 'frames':", std::string(table.text(*frames)));
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

void read_folder(const fs::path& folder, std::vector<BatchEntry>& inputs) {
  const std::size_t before = inputs.size();
  for (const fs::path& path : paths_in(folder)) {
    if (path.extension() == ".h5" && path.stem().extension() != ".map") {
      inputs.push_back({.path = path.string()});
    }
  }
  if (inputs.size() == before) {
    refuse(folder, "a folder without recordings (*.h5); give another one");
  }
}

/// For a pattern that the shell has left alone, such as one of more files than a command line
/// holds.
void read_pattern(const std::string& pattern, std::vector<BatchEntry>& inputs) {
  glob_t found{};
  if (::glob(pattern.c_str(), 0, nullptr, &found) != 0) {
    ::globfree(&found);
    refuse(pattern, "no file matches; give recordings, a folder of them or a manifest");
  }
  for (std::size_t i = 0; i < found.gl_pathc; ++i) {
    inputs.push_back({.path = found.gl_pathv[i]});
  }
  ::globfree(&found);
}

/// @param inferred whose pressure unit the recording must have; none: any unit will do
/// @throws Error (Fault::input) where the recording is at fault
ReadInput read_input(const BatchEntry& input, const Request& request,
                     const Circumstances* inferred) {
  const auto recording = std::make_shared<Recording>(read_recording(input.path));
  Recording like = inferred == nullptr ? Recording{} : Recording{.path = inferred->source};
  like.pressure_unit = inferred == nullptr ? recording->pressure_unit : inferred->pressure_unit;
  require_touches(*recording, like);
  replace_array(request, *recording);
  ReadInput read{recording,
                 unknowns_in(request, input.frames ? input.frames : request.frames, *recording)};
  for (Query& unknown : read.unknowns) {
    if (!input.label.empty() && unknown.truth.label != input.label) {
      unknown.truth = {input.label, {}};
    }
  }
  return read;
}

InputSurvey survey_of(const BatchEntry& entry, const Request& request) {
  InputSurvey survey;
  input_fault_of([&] {
    const ReadInput read = read_input(entry, request, nullptr);
    survey = {.touches = 0,
              .reach_mm = largest_reach_mm(std::span(read.recording.get(), 1)),
              .pressure_unit = read.recording->pressure_unit};
    for (const Query& unknown : read.unknowns) {
      survey.touches += unknown.touches.size();
    }
  });
  return survey;
}

constexpr const char* begin_again = "begin again, in another folder";

/// Unknowns that have the error of their recording.
ReadInput broken_input(const BatchEntry& input, std::size_t count, const Request& request,
                       const std::string& error) {
  const Query unknown{.recording = input.path,
                      .frame = {},
                      .touches = {},
                      .truth = {input.label, {}},
                      .error = error};
  ReadInput broken{nullptr, std::vector(count, unknown)};
  const std::optional<Frames>& frames = input.frames ? input.frames : request.frames;
  for (std::size_t i = 0; count > 1 && i < count; ++i) {
    broken.unknowns[i].frame = (frames ? frames->begin : 0) + i;
  }
  return broken;
}

}  // namespace

std::vector<BatchEntry> list_inputs(std::span<const std::string> arguments) {
  std::vector<BatchEntry> inputs;
  for (const std::string& argument : arguments) {
    std::error_code ignored;
    if (fs::is_directory(argument, ignored)) {
      read_folder(argument, inputs);
    } else if (alike(fs::path(argument).extension().string(), ".csv")) {
      read_manifest(argument, inputs);
    } else if (argument.find_first_of("*?[") != argument.npos && !fs::exists(argument, ignored)) {
      read_pattern(argument, inputs);
    } else {
      inputs.push_back({.path = argument});
    }
  }
  if (inputs.empty()) {
    refuse(arguments.front(), "names no recording; write a row for each");
  }
  for (BatchEntry& entry : inputs) {
    entry.stamp = stamp_of(entry.path);
  }
  return inputs;
}

ReadInput read_entry(const BatchTask& task, const BatchEntry& entry, const Request& request) {
  const std::size_t count = task.unknowns_of(entry);
  const auto require_unchanged = [&] {
    if (stamp_of(entry.path) != entry.stamp) {
      refuse(entry.path, "has changed since the batch began; {}", begin_again);
    }
  };
  require_unchanged();
  ReadInput read;
  const auto fault = input_fault_of([&] { read = read_input(entry, request, &task.inferred); });
  require_unchanged();
  if (fault) {
    return broken_input(entry, count, request, *fault);
  }
  if (read.unknowns.size() != count) {
    refuse(entry.path, "has {} unknowns, but had {} when the batch began; {}", read.unknowns.size(),
           count, begin_again);
  }
  return read;
}

void survey_inputs(std::span<BatchEntry> inputs, const Request& request, std::size_t threads,
                   const std::function<void(double)>& progress) {
  if (!request.each_frame && !infers_region(request)) {
    return;
  }
  std::atomic<std::size_t> done = 0;
  const auto caller = std::this_thread::get_id();
  tbb::task_arena arena(static_cast<int>(std::clamp<std::size_t>(threads, 1, inputs.size())));
  arena.execute([&] {
    parallel_for(inputs.size(), [&](std::size_t i) {
      inputs[i].survey = survey_of(inputs[i], request);
      ++done;
      if (std::this_thread::get_id() == caller) {
        progress(static_cast<double>(done) / static_cast<double>(inputs.size()));
      }
    });
  });
}

Circumstances infer(std::span<const BatchEntry> inputs, const Request& request) {
  Circumstances inferred{.pressure_unit = "kPa"};
  const auto surveyed = [&](const BatchEntry& entry) {
    return entry.survey ? *entry.survey : survey_of(entry, request);
  };
  for (const BatchEntry& entry : inputs) {
    if (const InputSurvey survey = surveyed(entry); !survey.pressure_unit.empty()) {
      inferred.pressure_unit = survey.pressure_unit;
      inferred.source = entry.path;
      break;
    }
  }
  if (inputs.front().survey) {
    for (const BatchEntry& entry : inputs) {
      inferred.reach_mm = std::max(inferred.reach_mm, entry.survey->reach_mm);
    }
  }
  return inferred;
}

}  // namespace palpate
