#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
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
#include "cli/planned_touch.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/terminal.hpp"
#include "io/command_files.hpp"
#include "io/pose_table.hpp"
#include "palpate/files.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/recordings.hpp"
#include "recognition/unknowns.hpp"

namespace palpate::cli {

namespace {

struct Options {
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

constexpr const char* grid = "grid";

/// The touches of the recording that the request selects, as one unknown.
Unknown select_touches(const Request& request, const Recording& recording) {
  Unknown unknown = list_unknowns(request, std::span(&recording, 1)).front();
  if (unknown.touches.empty()) {
    refuse(recording.path, "has no touches; give a recording with at least one");
  }
  return unknown;
}

/// The elements of a touch that are alive.
std::vector<glm::dvec2> living_elements(const Touch& touch, const std::string& recording) {
  std::vector<glm::dvec2> living;
  for (std::size_t e = 0; e < touch.elements_mm.size(); ++e) {
    if (touch.valid.empty() || touch.valid[e] != 0) {
      living.push_back(touch.elements_mm[e]);
    }
  }
  if (living.empty()) {
    refuse(recording, "valid: every element is dead; a touch would tell nothing");
  }
  return living;
}

/// The poses of a file: of a recording's touches, or the rows of a table.
std::vector<Pose> read_candidates(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".h5" || extension == ".hdf5") {
    return read_touch_recordings({path.string()}).front().T_robot_sensor;
  }
  const PoseTable table = read_poses(path, {.may_name_poses = false}, false);
  if (table.assumed_units) {
    fmt::print(stderr,
               "palpate: {}: poses taken to be in mm and rad; name the columns x_mm, y_mm, "
               "theta_deg for others\n",
               path.string());
  }
  return table.T_robot_sensor;
}

/// Throws Error on a candidate that no robot reaches.
void check_candidates(const std::string& file, const std::vector<Pose>& candidates) {
  constexpr std::size_t most = 1'000'000;
  if (candidates.empty()) {
    refuse(file, "holds no pose; write one for each candidate touch");
  }
  if (candidates.size() > most) {
    refuse(file, "holds {} poses; give at most {}", candidates.size(), most);
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Pose& pose = candidates[i];
    if (!(std::abs(pose.translation_mm.x) <= farthest_mm &&
          std::abs(pose.translation_mm.y) <= farthest_mm && std::isfinite(pose.theta_rad))) {
      refuse(file, "pose {} (counted from 0) is unknown or out of reach; give x, y and theta", i);
    }
  }
}

/// Throws Error where an output cannot be written, before any work is done.
void check_outputs(const Options& options, const Request& request) {
  CommandFiles files;
  files.reads("RECORDING", options.recording);
  if (options.candidates != grid && options.candidates != options.recording) {
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

void write_results(const Options& options, const Plan& plan, const Device& device) {
  // The path of a recording need not be UTF-8, as JSON must.
  const std::string json =
      to_json(plan, device.name())
          .dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
      "\n";
  // Files come first: printing fails where the reader of standard output has ended.
  if (!options.png.empty()) {
    write_file(options.png, draw_plan(figure_of(plan)));
  }
  if (options.json == "-") {
    fmt::print("{}", json);
    return;
  }
  if (!options.json.empty()) {
    write_file(options.json, json);
  }
  fmt::print("{}{}\n", plan_text(plan, terminal_columns(STDOUT_FILENO)),
             setup_words(device, plan.task));
}

void plan_touches(const Options& options) {
  const PlanGoal goal = parse_goal("--goal", options.goal);
  constexpr std::size_t most_samples = 4096;
  if (options.samples < 2 || options.samples > most_samples) {
    refuse_flag("--samples", options.samples, "give 2 to {}", most_samples);
  }
  const Request request = complete(options.request);
  std::vector<Recording> recordings = read_touch_recordings({options.recording});
  Recording& recording = recordings.front();
  replace_array(request, recording.path, recording.elements(), recording.elements_mm);
  const Unknown unknown = select_touches(request, recording);
  const std::vector<Touch>& touches = unknown.touches;
  const std::vector<glm::dvec2> elements_mm = living_elements(touches.front(), recording.path);
  std::vector<Pose> candidates;
  if (options.candidates != grid) {
    candidates = read_candidates(options.candidates);
    check_candidates(options.candidates, candidates);
  }
  double reach_mm = 0.0;
  for (const Touch& touch : touches) {  // the array may change between touches
    reach_mm = std::max(reach_mm, array_reach_mm(touch.elements_mm));
  }
  DeviceInWaiting device_in_waiting(request.device);
  const RecognitionTask task = resolve(request, {.pressure_unit = recording.pressure_unit,
                                                 .source = recording.path,
                                                 .reach_mm = reach_mm,
                                                 .need = {.why = plan_needs},
                                                 .device = std::ref(device_in_waiting)});
  if (!traits_of(task.filter).every_bin) {
    refuse("--filter particles", "{}; use --filter histogram, or leave it out", plan_needs);
  }
  check_outputs(options, request);
  Device& device = device_in_waiting();
  Recogniser recogniser = open_telling(device, task);
  const RecognitionRecord record = recognise(recogniser, task, unknown, false);
  record.require_steps();
  if (const auto words = unresolved_words(task, recogniser.lattice(), touches); !words.empty()) {
    tell_on_stderr(words);
  }

  const auto start = std::chrono::steady_clock::now();
  Plan plan{.goal = goal,
            .task = task,
            .record = record,
            .touches = touches,
            .elements_mm = elements_mm,
            .samples = recogniser.sample(options.samples, options.seed),
            .seed = options.seed};
  if (options.candidates == grid) {
    candidates =
        candidate_grid(plan.samples, task, elements_mm, touches.front().T_robot_sensor.theta_rad);
  }
  plan.ranked = rank_touches(*recogniser.histogram(), task, candidates, elements_mm, goal,
                             {.samples = options.samples, .seed = options.seed});
  plan.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  // Gains are of the belief before temperature and features.
  plan.identity_nats = label_entropy(sums_by_label(recogniser.estimate(), task), task);
  plan.both_nats = recogniser.histogram()->entropy();
  write_results(options, plan, device);
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
  const auto options = std::make_shared<Options>();
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
