#include <algorithm>
#include <array>
#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/options.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/record_table.hpp"
#include "cli/step_words.hpp"
#include "cli/text_table.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"
#include "recognition/touch_plan.hpp"

namespace palpate::cli {

namespace {

std::string believed_words(const Plan& plan) {
  return fmt::format(
      "after {}: {:.2f} nats unknown of the identity, {:.2f} of the pose, counted in bins",
      count_of(plan.record.touches, "touch", "touches"), plan.identity_nats,
      std::max(plan.both_nats - plan.identity_nats, 0.0));
}

std::string table_of(const Plan& plan) {
  constexpr std::size_t most_rows = 10;
  TextTable table(
      {{"rank", true},
       {"x mm", true},
       {"y mm", true},
       {"theta deg", true},
       {plan.goal == PlanGoal::both ? "gain nats" : goal_word(plan.goal) + " nats", true},
       {"identity", true},
       {"pose", true},
       {"candidate", true}});
  for (std::size_t i = 0; i < std::min(plan.ranked.size(), most_rows); ++i) {
    const PlannedTouch& touch = plan.ranked[i];
    const std::array<std::string, 3> pose = pose_cells(touch.T_robot_sensor);
    table.add({std::to_string(i + 1), pose[0], pose[1], pose[2], gain_text(touch.gain, plan.goal),
               // The goal's gain stands in its own column; one without content is left out.
               plan.goal == PlanGoal::identity ? "" : fmt::format("{:.2f}", touch.gain.identity),
               plan.goal == PlanGoal::pose ? "" : fmt::format("{:.2f}", touch.gain.pose),
               std::to_string(touch.index)});
  }
  return table.text();
}

/// Whether to act, what is believed, the ten best candidates, what is wrong with the touches, and
/// the best one.
std::string plan_text(const Plan& plan, const RecognitionTask& task) {
  const std::string limit = in_flags(limit_words(plan));
  const std::string decision = sentences_of(plan.record.last(), task).decision;
  return fmt::format("{}{}\n{}\n\n{}{}{}\n{}, {} in {:.0f} ms\n",
                     decision.empty() ? "" : decision + "\n",
                     result_words(plan.record.last(), task), believed_words(plan), table_of(plan),
                     findings({plan.record}, task), limit.empty() ? "" : limit + "\n",
                     next_touch_words(plan.ranked.front(), plan.goal),
                     count_of(plan.ranked.size(), "candidate", "candidates"), 1e3 * plan.seconds);
}

struct PlanArguments {
  std::string recording;
  std::string candidates;
  std::string goal = "both";
  std::size_t samples = PlanOptions{}.samples;
  std::uint64_t seed = 0;
  Request request;
  bool verbose = false;
  std::string json;
};

void plan_touches(const PlanArguments& options) {
  const PlanRequest wanted =
      plan_request(options.goal, options.candidates, options.samples, options.seed, tell_on_stderr);
  const RecognitionJob job{complete(options.request), read_touch_recordings({options.recording})};
  const RecognitionTask& task = job.task();
  require_plannable(task);
  CommandFiles files;
  files.reads("RECORDING", options.recording);
  if (options.candidates != candidate_grid_word && options.candidates != options.recording) {
    files.reads("--candidates", options.candidates);
  }
  add_recognition_files(job.request(), files);
  files.writes("--json", options.json, CommandFiles::Dash::stream).prepare();
  Recogniser recogniser = open_telling(job);
  const Plan plan = plan_touch(recogniser, task, job.unknowns().front(), wanted);
  if (const std::string words = recogniser.unresolved_words(); !words.empty()) {
    tell_on_stderr(words);
  }
  give_result(options.json, text_of(to_json(plan, task, job.device_name()), 2),
              plan_text(plan, task) + setup_words(job) + "\n");
  if (options.verbose) {
    print_engine(job, recogniser);
  }
}

}  // namespace

void add_plan(CLI::App& app) {
  const auto [command, options] = add_command<PlanArguments>(
      app, "plan",
      "Rank poses for the next touch by what each is expected to tell, in nats, given the touches "
      "of a recording: the mutual information between the touch's readings and the object and its "
      "pose. Prints the ten best poses T_robot_sensor, in the robot frame",
      plan_touches);
  add_required(*command, "RECORDING", options->recording, "Recording of the touches so far (HDF5)");
  add_recognition_flags(*command, options->request, options->verbose);
  // Out of the help, as the plan needs bins; read still, to be refused with the reason.
  for (const char* flag : {"--particles", "--resampling", "--augmented", "--seed"}) {
    command->get_option(flag)->group("");
  }
  add_required(*command, "--candidates", options->candidates,
               "Sensor poses T_robot_sensor to choose from: a CSV file with the columns x, y "
               "and theta (or yaw; in mm and rad, or as the names say: x_m, theta_deg), the "
               "touches of a recording (.h5), or grid: 100 to 300 poses about the places where "
               "the object may be, half an array apart, at four angles");
  add_with_default(*command, "--goal", options->goal,
                   "What the touch shall tell: identity, pose (once the object is known) or both");
  add_option_flag(*command, options->request, "frames");
  add_option_flag(*command, options->request, "touches");
  add_with_default(*command, "--samples", options->samples,
                   "Objects and poses that stand for the belief; the time grows with its square")
      ->check(require_whole_number);
  add_with_default(*command, "--plan-seed", options->seed,
                   "Seed of the samples and of the readings that they simulate")
      ->check(require_whole_number);
  command->add_option(
      "--json", options->json,
      "Write what is believed and all candidates, the best first, as JSON; - is standard output");
}

}  // namespace palpate::cli
