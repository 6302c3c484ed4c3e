#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/progress.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/record_table.hpp"
#include "cli/sheet.hpp"
#include "cli/step_words.hpp"
#include "io/atomic_file.hpp"
#include "palpate/files.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

struct RecognizeArguments {
  std::vector<std::string> recordings;
  Request request;
  bool verbose = false;
  std::string json;
  std::string posterior;
  std::string png;
};

std::filesystem::path png_path(const RecognizeArguments& options, const Query& unknown) {
  const std::string stem = std::filesystem::path(unknown.recording).stem().string();
  return std::filesystem::path(options.png) /
         (unknown.frame ? fmt::format("{}.{}.png", stem, *unknown.frame) : stem + ".png");
}

/// Throws Error where an output cannot be written, before any work is done.
void check_outputs(const RecognizeArguments& options, const RecognitionJob& job) {
  const std::vector<Query>& unknowns = job.unknowns();
  CommandFiles files;
  files.reads("RECORDING", options.recordings);
  add_recognition_files(job.request(), files);
  if (!options.posterior.empty()) {
    if (!traits_of(job.task().filter).bins) {
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
  files.writes("--json", options.json, CommandFiles::Dash::stream);
  if (!options.png.empty()) {
    std::set<std::filesystem::path> pictures;
    for (const Query& unknown : unknowns) {
      if (!pictures.insert(png_path(options, unknown)).second) {
        refuse(unknown.recording,
               "its picture would overwrite the picture of another recording of the same name; "
               "rename one of them");
      }
      files.writes_in("--png", options.png, png_path(options, unknown).filename());
    }
  }
  files.prepare();
}

void export_posterior(const std::filesystem::path& path, const RecognitionTask& task,
                      const Recogniser& recogniser) {
  std::vector<std::string> labels;
  for (const Hypothesis& hypothesis : task.hypotheses) {
    labels.push_back(hypothesis.map.label);
  }
  if (std::optional<EvaluatedBelief> evaluated = recogniser.filter().evaluated_bins()) {
    write_posterior(path, {.objects = std::move(labels),
                           .lattice = recogniser.lattice(),
                           .log_likelihood = std::move(evaluated->log_likelihood),
                           .rest_mass_bound = evaluated->rest_mass_bound,
                           .index = std::move(evaluated->index)});
    return;
  }
  const PoseHistogram& histogram = *recogniser.filter().histogram();
  write_posterior(path, labels, histogram.lattice(), [&](std::size_t object) {
    return histogram.log_likelihood(static_cast<int>(object));
  });
}

void recognize(const RecognizeArguments& options) {
  const RecognitionJob job{complete(options.request),
                           read_touch_recordings(options.recordings),
                           {.every_bin_for = options.posterior.empty() ? "" : "posterior"}};
  const Request& request = job.request();
  const RecognitionTask& task = job.task();
  check_outputs(options, job);
  std::string unresolved;
  std::vector<RecognitionRecord> records;
  std::optional<Progress> progress("recognising");
  double done = 0.0;  // of the present unknown
  const auto show_progress = [&] {
    const std::size_t all = job.unknowns().size();
    progress->show((static_cast<double>(records.size()) + done) / static_cast<double>(all),
                   all == 1 ? ""
                            : fmt::format(", {:.0f} % of unknown {} of {}", 100.0 * done,
                                          records.size() + 1, all));
  };
  Recogniser recogniser = open_telling(job, [&] {
    // Between the steps of bounds' searches, which may take minutes.
    if (progress) {
      show_progress();
    }
  });
  if (!options.png.empty()) {
    make_folder(options.png);
  }

  // The picture shows the identity after every touch, so it needs the trace.
  const bool trace = request.trace || !options.png.empty();
  auto json = nlohmann::ordered_json::array();
  for (const Query& unknown : job.unknowns()) {
    const auto show = [&](double fraction) {
      done = fraction;
      show_progress();
    };
    records.push_back(recognise(recogniser, task, unknown, trace, show, !request.trace));
    records.back().require_steps();
    done = 0.0;
    if (unresolved.empty()) {
      unresolved = recogniser.unresolved_words();
    }
    if (!options.json.empty()) {
      json.push_back(to_json(records.back(), task, job.device_name(), request.trace));
    }
    if (!options.png.empty()) {
      write_file(
          png_path(options, unknown),
          draw_recognition(sheet_of(records.back(), unknown, task,
                                    belief_of(recogniser, records.back().last().mode.object))));
    }
  }
  progress.reset();

  if (!unresolved.empty()) {
    tell_on_stderr(unresolved);
  }
  // Files come first, both or none: printing fails where the reader of standard output has ended.
  const std::string json_text = text_of(json, 2);
  std::optional<AtomicFile> json_file;
  if (!options.json.empty() && options.json != "-") {
    json_file.emplace(options.json);
    json_file->write(json_text);
  }
  if (!options.posterior.empty()) {
    export_posterior(options.posterior, task, recogniser);
  }
  if (json_file) {
    json_file->commit();
  }
  std::string text;
  for (const RecognitionRecord& record : records) {
    text += request.trace ? trace_table(record, task) + "\n" : "";
  }
  fmt::print("{}", options.json == "-"
                       ? json_text
                       : text + result_table(records, task) + setup_words(job) + "\n");
  if (options.verbose) {
    double seconds = 0.0;
    for (const RecognitionRecord& record : records) {
      seconds += record.seconds;
    }
    print_engine(job, recogniser);
    fmt::print(stderr, "seconds: {:.3f} to recognise\n", seconds);
  }
}

}  // namespace

void add_recognize(CLI::App& app) {
  const auto [command, options] = add_command<RecognizeArguments>(
      app, "recognize",
      "Recognise the object of each recording among known maps and find its pose in the robot "
      "frame, T_robot_object: p_robot = R(theta) p_object + (x, y), with one standard deviation. "
      "The JSON file has T_object_robot as well",
      recognize);
  add_required(*command, "RECORDING", options->recordings, "Recordings of unknown objects (HDF5)");
  add_recognition_flags(*command, options->request, options->verbose);
  add_selection_flags(*command, options->request);
  command->add_option("--json", options->json, "Write the records as JSON; - is standard output");
  command->add_option("--posterior", options->posterior,
                      "Write the log-likelihood of every bin (HDF5), with --filter bounded of "
                      "those that it evaluated; for one recording or frame");
  command->add_option("--png", options->png,
                      "Folder for a picture of each unknown: the touches on the map, the belief "
                      "over x and y, the identity after every touch");
}

}  // namespace palpate::cli
