#include <unistd.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/commands.hpp"
#include "cli/engine_words.hpp"
#include "cli/options.hpp"
#include "cli/plan_output.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/terminal.hpp"
#include "io/command_files.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"

namespace palpate::cli {

namespace {

struct PlanArguments {
  std::string recording;
  std::string candidates;
  std::string goal = "both";
  std::size_t samples = PlanOptions{}.samples;
  std::uint64_t seed = 0;
  Request request;
  bool verbose = false;
  std::string json;
  std::string png;
};

/// Throws Error where an output cannot be written, before any work is done.
void check_outputs(const PlanArguments& options, const Request& request) {
  CommandFiles files;
  files.reads("RECORDING", options.recording);
  if (options.candidates != candidate_grid_word && options.candidates != options.recording) {
    files.reads("--candidates", options.candidates);
  }
  add_recognition_files(request, files);
  if (!options.json.empty()) {
    files.writes("--json", options.json, CommandFiles::Dash::stream);
  }
  if (!options.png.empty()) {
    files.writes("--png", options.png);
  }
  files.require_distinct();
  for (const std::string& file : {options.json, options.png}) {
    if (!file.empty() && file != "-") {
      require_writable(file);
    }
  }
}

void write_results(const PlanArguments& options, const Plan& plan, const RecognitionTask& task,
                   std::span<const Touch> touches, const Device& device) {
  const std::string json = text_of(to_json(plan, task, device.name()), 2);
  // Files come first: printing fails where the reader of standard output has ended.
  if (!options.png.empty()) {
    write_file(options.png, draw_plan(figure_of(plan, task, touches)));
  }
  if (options.json == "-") {
    fmt::print("{}", json);
    return;
  }
  if (!options.json.empty()) {
    write_file(options.json, json);
  }
  fmt::print("{}{}\n", plan_text(plan, task, terminal_columns(STDOUT_FILENO)),
             setup_words(device, task));
}

void plan_touches(const PlanArguments& options) {
  const PlanRequest wanted =
      plan_request(options.goal, options.candidates, options.samples, options.seed, tell_on_stderr);
  const Request request = complete(options.request);
  std::vector<Recording> recordings = read_touch_recordings({options.recording});
  Recording& recording = recordings.front();
  replace_array(request, recording.path, recording.elements(), recording.elements_mm);
  const Unknown unknown = list_unknowns(request, recordings).front();
  DeviceInWaiting device_in_waiting(request.device);
  const RecognitionTask task = resolve(request, {.pressure_unit = recording.pressure_unit,
                                                 .source = recording.path,
                                                 .reach_mm = largest_reach_mm(unknown.touches),
                                                 .need = {.why = plan_needs},
                                                 .device = std::ref(device_in_waiting)});
  require_histogram(task);
  check_outputs(options, request);
  Device& device = device_in_waiting();
  Recogniser recogniser = open_telling(device, task);
  const Plan plan = plan_touch(recogniser, task, unknown, wanted);
  if (const auto words = unresolved_words(task, recogniser.lattice(), unknown.touches);
      !words.empty()) {
    tell_on_stderr(words);
  }
  write_results(options, plan, task, unknown.touches, device);
  if (options.verbose) {
    print_engine(&device, recogniser, task);
  }
}

}  // namespace

void add_plan(CLI::App& app) {
  auto* command = app.add_subcommand(
      "plan",
      "Rank poses for the next touch by what each is expected to tell, in nats, given the touches "
      "of a recording: the mutual information between the touch's readings and the object and its "
      "pose. Prints the ten best poses T_robot_sensor, in the robot frame");
  const auto options = std::make_shared<PlanArguments>();
  command->add_option("RECORDING", options->recording, "Recording of the touches so far (HDF5)")
      ->required();
  add_recognition_flags(*command, options->request, options->verbose);
  hide_other_filters(*command);
  command
      ->add_option(
          "--candidates", options->candidates,
          "Sensor poses T_robot_sensor to choose from: a CSV file with the columns x, y and theta "
          "(or yaw; in mm and rad, or as the names say: x_m, theta_deg), the touches of a "
          "recording (.h5), or grid: 100 to 300 poses about the places where the object may be, "
          "half an array apart, at four angles")
      ->required();
  command
      ->add_option("--goal", options->goal,
                   "What the touch shall tell: identity, pose (once the object is known) or both")
      ->capture_default_str();
  add_frames_flag(*command, options->request.frames,
                  "Use the touches A to B - 1 of the recording, counted from 0, as A:B");
  command
      ->add_option("--touches", options->request.touches,
                   "Use the first N touches of the recording [default: all]")
      ->check(require_whole_number);
  command
      ->add_option("--samples", options->samples,
                   "Objects and poses that stand for the belief; the time grows with its square")
      ->check(require_whole_number)
      ->capture_default_str();
  command
      ->add_option("--plan-seed", options->seed,
                   "Seed of the samples and of the readings that they simulate")
      ->check(require_whole_number)
      ->capture_default_str();
  command->add_option("--json", options->json,
                      "Write what is believed and all candidates, the best first, as JSON; - is "
                      "standard output");
  command->add_option("--png", options->png,
                      "Write a picture: the candidates, coloured by gain, over the places where "
                      "the object may be");
  command->callback([options] { plan_touches(*options); });
}

}  // namespace palpate::cli
