#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "command_run.hpp"
#include "letters.hpp"
#include "palpate/balanced_lattice.hpp"
#include "pose_window.hpp"
#include "sweep_document.hpp"
#include "trials.hpp"

namespace palpate::bench {

namespace {

// Unknowns of their own: the sweep's and the experiment's chose other constants.
constexpr std::uint64_t unknown_seed = 70'000;

/// What is measured, in this order.
struct Plan {
  int trials_each = 0;  ///< for every letter
  std::vector<double> cells_mm;
  std::vector<int> touches;
  std::vector<double> steps;  ///< by rising size; the first is what the others are compared with
};

Plan plan_of(const BinStepsOptions& options) {
  Plan plan{.trials_each = options.trials.value_or(options.quick ? 1 : 20),
            .cells_mm = {0.5, 1.0, 0.25},
            .touches = {3, 5, 9},
            .steps = {fine_step, 0.8, 1.0, balanced_step, 1.4, 1.6, 1.8, 2.0, 2.5}};
  if (options.quick) {
    plan.cells_mm = {0.5};
    plan.touches = {5};
    plan.steps = {fine_step, balanced_step};
  }
  return plan;
}

/// The first touches of a trial, and the truth.
Recording first_touches(const Recording& trial, int touches) {
  Recording first = trial;
  first.T_robot_sensor.resize(static_cast<std::size_t>(touches));
  first.pressure.resize(trial.elements() * static_cast<std::size_t>(touches));
  return first;
}

TrialErrors refined_errors(Device& device, std::span<const Hypothesis> letters,
                           std::span<const Recording> trials, PoseLattice lattice, int touches) {
  PoseErrors errors;
  for (const Recording& trial : trials) {
    lattice.pivot_mm = trial.T_robot_sensor.front().translation_mm;
    errors.add(estimate_in_window(device, letters, first_touches(trial, touches), lattice));
  }
  return errors.refined_mm;
}

std::vector<Column> columns() {
  return {{"map cells, mm", "/cell_mm"},
          {"step", "/step"},
          {"bins per object", "/bins"},
          {"", "/count", count_text},
          {"touches", "/touches"},
          {"refined: mean error, mm", "/refined_error_mm", mean_text},
          {"over the finest, %", "/excess", number_text("{:+.1f}", 100.0)},
          {"difference, mm", "/difference_mm", difference_text}};
}

/// Prints every run once it is known.
Json measure(Device& device, const Plan& plan) {
  const std::vector<Recording> trials = make_trials(vowels, plan.trials_each, plan.touches.back(),
                                                    unknown_seed, {.at_random_poses = true});
  Json runs = Json::array();
  print_head(columns());
  for (const double cell_mm : plan.cells_mm) {
    const std::vector<Hypothesis> letters =
        letter_maps(device, training_recordings(), MapOptions{.cell_mm = cell_mm});
    const PoseLattice region =
        touch_region(letters, array_reach_mm(trials.front().elements_mm)).lattice;
    std::map<int, TrialErrors> finest;  // by touches
    for (const double step : plan.steps) {
      const PoseLattice lattice =
          balanced_lattice(region, letters, std::numeric_limits<std::int64_t>::max(), step).lattice;
      for (const int touches : plan.touches) {
        const TrialErrors errors = refined_errors(device, letters, trials, lattice, touches);
        const TrialErrors& best = finest.emplace(touches, errors).first->second;
        const PairedErrors paired = paired_errors(errors, best);
        runs.push_back(
            {{"cell_mm", cell_mm},
             {"step", step},
             {"bins", {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count}},
             {"count", lattice.bins()},
             {"touches", touches},
             {"refined_error_mm", record_of(errors_over(errors))},
             {"excess", paired.first_mm / paired.second_mm - 1.0},
             {"difference_mm", step == plan.steps.front() ? Json() : difference_of(paired)}});
        print_row(columns(), runs.back());
        std::fflush(stdout);
      }
    }
  }
  return runs;
}

}  // namespace

void run_bin_steps(const BinStepsOptions& options, std::span<char* const> command_line) {
  require_at_least("--trials", options.trials, 1);
  CommandRun run(options, {{"--json", options.json}}, command_line);
  Json document = run.facts();
  document["runs"] = measure(run.device(), plan_of(options));
  run.write(options.json, document.dump(2) + "\n");
}

}  // namespace palpate::bench
