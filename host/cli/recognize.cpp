#include "commands.hpp"

#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "atomic_file.hpp"
#include "command_files.hpp"
#include "figures.hpp"
#include "options.hpp"
#include "palpate/files.hpp"
#include "progress.hpp"
#include "recognition_flags.hpp"
#include "record_output.hpp"
#include "recordings.hpp"

namespace palpate::cli {

namespace {

struct Options {
  std::vector<std::string> recordings;
  std::string frames;
  std::optional<int> touches;
  bool each_frame = false;
  RecognitionFlags recognition;
  bool trace = false;
  std::string json;
  std::string posterior;
  std::string png;
};

/// The unknowns that the flags select: views into the recordings' memory.
std::vector<Unknown> list_unknowns(const Options& options,
                                   const std::vector<Recording>& recordings) {
  std::optional<Frames> frames;
  if (!options.frames.empty()) {
    frames = parse_frames("--frames", options.frames);
  }
  if (options.touches && *options.touches < 1) {
    refuse_flag("--touches", *options.touches, "give at least 1");
  }
  if (options.touches && options.each_frame) {
    refuse("--touches", "with --each-frame every unknown has one touch; leave one of them out");
  }
  std::vector<Unknown> unknowns;
  for (const Recording& recording : recordings) {
    auto [begin, end] = select(recording, frames);
    if (options.touches && static_cast<std::size_t>(*options.touches) > end - begin) {
      refuse(recording.path, "has {} touches; --touches {} is too many", end - begin,
             *options.touches);
    }
    const GroundTruth truth = ground_truth(recording.object, recording.truth);
    if (options.each_frame) {
      for (std::size_t i = begin; i < end; ++i) {
        unknowns.push_back({recording.path, i, {recording.touch(i)}, truth});
      }
    } else {
      end = options.touches ? begin + static_cast<std::size_t>(*options.touches) : end;
      unknowns.push_back({recording.path, {}, recording.touches(begin, end), truth});
    }
  }
  return unknowns;
}

std::filesystem::path png_path(const Options& options, const Unknown& unknown) {
  const std::string stem = std::filesystem::path(unknown.recording).stem().string();
  return std::filesystem::path(options.png) /
         (unknown.frame ? fmt::format("{}.{}.png", stem, *unknown.frame) : stem + ".png");
}

/// Throws Error where an output cannot be written, before any work is done.
void check_outputs(const Options& options, const Scene& scene, const RecognitionTask& task,
                   const std::vector<Unknown>& unknowns) {
  CommandFiles files;
  for (const std::string& recording : options.recordings) {
    files.reads("RECORDING", recording);
  }
  add_recognition_files(options.recognition, scene, task, files);
  if (!options.posterior.empty()) {
    if (std::holds_alternative<ParticleOptions>(task.filter)) {
      refuse_flag("--posterior", options.posterior,
                  "particles have no bins; use --filter histogram");
    }
    if (unknowns.size() != 1) {
      refuse_flag("--posterior", options.posterior,
                  "the file holds one unknown, not {}; select one recording or frame",
                  unknowns.size());
    }
    files.writes("--posterior", options.posterior);
  }
  if (!options.json.empty()) {
    files.writes("--json", options.json, CommandFiles::Dash::stream);
  }
  if (!options.png.empty()) {
    std::set<std::filesystem::path> pictures;
    for (const Unknown& unknown : unknowns) {
      if (!pictures.insert(png_path(options, unknown)).second) {
        refuse(unknown.recording,
               "its picture would overwrite the picture of another recording of the same name; "
               "rename one of them");
      }
      files.writes("--png", png_path(options, unknown));
    }
  }
  files.require_distinct();
  for (const std::string& file : {options.posterior, options.json}) {
    if (!file.empty() && file != "-") {
      require_writable(file);
    }
  }
  if (std::filesystem::is_directory(options.png)) {
    for (const Unknown& unknown : unknowns) {
      require_writable(png_path(options, unknown));
    }
  }
}

/// Edge of the squares that stand for elements, mm: 90 % of the pitch, at most 1.8 mm.
double element_edge_mm(const Touch& touch) {
  const glm::dvec2& first = touch.elements_mm.front();
  double nearest = 2.0;
  for (const glm::dvec2& other : touch.elements_mm.subspan(1)) {
    nearest = std::min(nearest, std::hypot(other.x - first.x, other.y - first.y));
  }
  return 0.9 * nearest;
}

std::string draw_sheet(const RecognitionRecord& record, const Unknown& unknown,
                       const RecognitionTask& task, const Recogniser& recogniser) {
  const RecognitionStep& last = record.last();
  RecognitionSheet sheet;
  sheet.title = name_of(record);
  sheet.map = task.hypotheses[last.mode.object].map;
  sheet.element_mm = element_edge_mm(unknown.touches.front());
  sheet.T_object_robot = last.mode.T_object_robot;
  sheet.none = task.labels[last.best] == none_label;
  sheet.true_object = record.true_label;
  if (last.error_mm) {
    sheet.truth = unknown.truth.T_object_robot;
    sheet.error_mm = last.error_mm;
  }
  sheet.belief = recogniser.marginals(last.mode.object);
  sheet.labels = task.labels;
  for (const Touch& touch : unknown.touches) {
    auto& footprint = sheet.footprints_mm.emplace_back();
    for (const glm::dvec2& element : touch.elements_mm) {
      footprint.push_back(touch.T_robot_sensor * element);
    }
  }
  for (const RecognitionStep& step : record.trace) {
    sheet.identity.push_back(step.identity);
  }
  return draw_recognition(sheet);
}

void export_posterior(const std::filesystem::path& path, const RecognitionTask& task,
                      const PoseHistogram& histogram) {
  std::vector<std::string> labels;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    labels.push_back(hypothesis.map.label);
  }
  write_posterior(path, labels, histogram.lattice(), [&](std::size_t object) {
    return histogram.log_likelihood(static_cast<int>(object));
  });
}

/// Writes posterior and JSON; where one of them cannot be written, neither appears.
void write_results(const Options& options, const RecognitionTask& task,
                   const Recogniser& recogniser, const std::string& json) {
  std::optional<AtomicFile> json_file;
  if (!options.json.empty() && options.json != "-") {
    json_file.emplace(options.json);
    json_file->write(json);
  }
  if (!options.posterior.empty()) {
    export_posterior(options.posterior, task, *recogniser.histogram());
  }
  if (json_file) {
    json_file->commit();
  }
}

void recognize(const Options& options) {
  const Scene scene = scene_of(options.recognition);
  std::vector<Recording> recordings = read_touch_recordings(options.recordings);
  for (Recording& recording : recordings) {
    replace_array(scene, options.recognition.scene, recording.path, recording.elements(),
                  recording.elements_mm);
  }
  const std::vector<Unknown> unknowns = list_unknowns(options, recordings);
  const Recording& first = recordings.front();
  double farthest_element_mm = 0.0;
  for (const Recording& recording : recordings) {
    farthest_element_mm = std::max(farthest_element_mm, array_reach_mm(recording.elements_mm));
  }
  RecognitionTask task =
      task_of(options.recognition, scene, first.pressure_unit, first.path, farthest_element_mm);
  if (auto* histogram = std::get_if<HistogramOptions>(&task.filter)) {
    histogram->still_array = array_is_still(unknowns);
  }
  check_outputs(options, scene, task, unknowns);
  Device device = open_device(options.recognition, scene);
  Recogniser recogniser = open_recogniser(device, task);
  if (!options.png.empty()) {
    make_folder(options.png);
  }

  // The picture shows the identity after every touch, so it needs the trace.
  const bool trace = options.trace || !options.png.empty();
  std::vector<RecognitionRecord> records;
  auto json = nlohmann::ordered_json::array();
  {
    Progress progress("recognising");
    for (const Unknown& unknown : unknowns) {
      const auto show = [&](double fraction) {
        progress.show((static_cast<double>(records.size()) + fraction) /
                      static_cast<double>(unknowns.size()));
      };
      records.push_back(recognise(recogniser, task, unknown, trace, show));
      records.back().require_steps();
      show(0.0);
      json.push_back(to_json(records.back(), task, device.name(), options.trace));
      if (!options.png.empty()) {
        write_file(png_path(options, unknown),
                   draw_sheet(records.back(), unknown, task, recogniser));
      }
    }
  }

  // The path of a recording need not be UTF-8, as JSON must.
  const std::string json_text =
      json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  // Files come first: printing fails where the reader of standard output has ended.
  write_results(options, task, recogniser, json_text);
  if (options.json == "-") {
    fmt::print("{}", json_text);
  } else {
    fmt::print("{}: {} maps, {}\n\n", device.name(), task.hypotheses.size(),
               filter_words(recogniser, task));
    if (options.trace) {
      for (const RecognitionRecord& record : records) {
        print_trace(record, task);
      }
      fmt::print("\n");
    }
    print_table(records, task);
  }
}

}  // namespace

void add_recognize(CLI::App& app) {
  auto* command = app.add_subcommand(
      "recognize",
      "Recognise the object of each recording among known maps and find its pose "
      "T_object_robot: p_object = R(theta) p_robot + (x, y)");
  const auto options = std::make_shared<Options>();
  command->add_option("RECORDING", options->recordings, "Recordings of unknown objects (HDF5)")
      ->required();
  add_recognition_flags(*command, options->recognition);
  command->add_option("--frames", options->frames,
                      "Use the touches A to B - 1 of every recording, counted from 0, as A:B");
  command
      ->add_option("--touches", options->touches,
                   "Use the first N touches of every recording [default: all]")
      ->check(require_whole_number);
  command->add_flag("--each-frame", options->each_frame,
                    "Recognise every touch by itself, as an unknown object of its own");
  command->add_flag("--trace", options->trace, "Show the estimate after every touch");
  command->add_option("--json", options->json, "Write the records as JSON; - is standard output");
  command->add_option("--posterior", options->posterior,
                      "Write the log-likelihood of every bin (HDF5); for one recording or frame");
  command->add_option(
      "--png", options->png,
      "Folder for a picture of each unknown: the touches on the map, the belief over x and y, "
      "the identity after every touch");
  command->callback([options] { recognize(*options); });
}

}  // namespace palpate::cli
