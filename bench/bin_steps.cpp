#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

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
  std::vector<double> steps_mm;  ///< rising; the first is what the others are compared with
};

Plan plan_of(const BinStepsOptions& options) {
  Plan plan{.trials_each = options.trials.value_or(options.quick ? 1 : 20),
            .cells_mm = {0.5, 1.0},
            .touches = {9, 5, 3},
            .steps_mm = {0.3, 0.45, 0.6, 0.75, 0.9, 1.2}};
  if (options.quick) {
    plan.cells_mm = {0.5};
    plan.touches = {5};
    plan.steps_mm = {0.3, 0.6};
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

/// The region in steps of at most this length; in theta, of what moves an object as far.
PoseLattice in_steps(const PoseLattice& region, std::span<const Hypothesis> letters,
                     double step_mm) {
  BalancedLattice fine =
      balanced_lattice(region, letters, std::numeric_limits<std::int64_t>::max(), BinWidth::fine);
  for (Axis* axis : {&fine.lattice.x_mm, &fine.lattice.y_mm, &fine.lattice.theta_rad}) {
    axis->count = static_cast<int>(std::ceil(axis->count * fine.step_mm / step_mm));
  }
  return fine.lattice;
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
          {"step, mm", "/step_mm"},
          {"bins per object", "/bins"},
          {"", "/count", count_text},
          {"touches", "/touches"},
          {"refined: mean error, mm", "/refined_error_mm", mean_text},
          {"median, mm", "/refined_error_mm/median", number_text("{:.3f}")},
          {"over the finest, %", "/excess", number_text("{:+.1f}", 100.0)},
          {"difference, mm", "/difference_mm", difference_text}};
}

/// Prints every run once it is known.
Json measure(Device& device, const Plan& plan) {
  const std::vector<Recording> trials =
      make_trials(vowels, plan.trials_each, std::ranges::max(plan.touches), unknown_seed,
                  {.at_random_poses = true});
  Json runs = Json::array();
  print_head(columns());
  for (const double cell_mm : plan.cells_mm) {
    const std::vector<Hypothesis> letters =
        letter_maps(device, training_recordings(), MapOptions{.cell_mm = cell_mm});
    const PoseLattice region =
        touch_region(letters, array_reach_mm(trials.front().elements_mm)).lattice;
    for (const int touches : plan.touches) {
      std::optional<TrialErrors> finest;
      for (const double step_mm : plan.steps_mm) {
        const PoseLattice lattice = in_steps(region, letters, step_mm);
        const TrialErrors errors = refined_errors(device, letters, trials, lattice, touches);
        const bool is_finest = !finest;
        finest = finest.value_or(errors);
        const PairedErrors paired = paired_errors(errors, *finest);
        runs.push_back({{"cell_mm", cell_mm},
                        {"step_mm", step_mm},
                        {"bins", {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count}},
                        {"count", lattice.bins()},
                        {"touches", touches},
                        {"refined_error_mm", record_of(errors_over(errors))},
                        {"excess", paired.first_mm / paired.second_mm - 1.0},
                        {"difference_mm", is_finest ? Json() : difference_of(paired)}});
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
