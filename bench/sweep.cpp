#include <cmath>

#include <fmt/format.h>

#include "command_run.hpp"
#include "letters.hpp"
#include "palpate/balanced_lattice.hpp"
#include "report.hpp"
#include "sweep_document.hpp"
#include "sweep_measurements.hpp"
#include "sweep_page.hpp"
#include "trials.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t particle_seed = 1;
constexpr double goal_mode_mm = 0.3;
constexpr double goal_refined_mm = 0.2;

std::vector<Recording> trials_of(int each) {
  return make_trials(vowels, each, touches_per_trial, trial_seed);
}

/// Measures maps of one cell size, and prints every run once it is known.
void sweep_cells(Device& device, const SweepPlan& plan, const CellPlan& cells, Json& document) {
  const std::vector<Hypothesis> letters =
      letter_maps(device, training_recordings(), MapOptions{.cell_mm = cells.cell_mm});
  const std::vector<Recording> trials = trials_of(plan.trials_each);
  Json& points = document["points"];
  const auto add = [&](Json point) {
    print_row(Columns(run_columns()).first(printed_run_columns), point);
    points.push_back(std::move(point));
  };
  for (const BinCounts& bins : cells.lattices) {
    add(measure_histogram(device, letters, trials, trials_of(plan.full_each(cells.cell_mm, bins)),
                          bins));
  }
  for (const auto& [resampling, augmented] :
       {std::pair{Resampling::multinomial, false}, std::pair{Resampling::systematic, false},
        std::pair{Resampling::multinomial, true}}) {
    for (const int particles : cells.particles) {
      add(measure_particles(device, letters, trials_of(plan.particle_trials_each(particles)),
                            {.particles = particles,
                             .region = lattice_with(goal_bins),
                             .resampling = resampling,
                             .augmented = augmented,
                             .seed = particle_seed}));
    }
  }
  for (const BinCounts& bins : cells.compared) {
    for (const Json& way : compare_paths(device, letters, trials.front(), lattice_with(bins))) {
      document["precisions"].push_back(way);
    }
  }
  for (const BinCounts& bins : cells.bounded) {
    document["bounds"].push_back(
        measure_bounds(device, letters, trials_of(plan.bounded_each(bins)), bins));
  }
  if (!cells.lattices.empty()) {
    const PoseLattice balanced =
        balanced_lattice(lattice_with(goal_bins), letters, most_balanced_bins, BinWidth::fine)
            .lattice;
    document["knees"].push_back(
        knee_record(points, cells.cell_mm,
                    {balanced.x_mm.count, balanced.y_mm.count, balanced.theta_rad.count}));
  }
}

/// The mean errors on the goal's lattice against their goals.
Json verdicts_of(const Json& points) {
  Json verdicts = Json::array();
  for (const Json& point : points) {
    if (point.at("bins") != Json(goal_bins) || point.at("cell_mm") != goal_cell_mm) {
      continue;
    }
    for (const auto& [name, error_mm, goal_mm] :
         {std::tuple{"mean error by the mode", point.at("error_mm"), goal_mode_mm},
          std::tuple{"mean error refined", point.at("refined_error_mm"), goal_refined_mm}}) {
      if (!error_mm.is_null()) {
        verdicts.push_back(record_of(Measurement{
            .name = fmt::format("{}, {} x {} x {} bins, {} touches, {} of {} trials", name,
                                goal_bins[0], goal_bins[1], goal_bins[2], touches_per_trial,
                                plain_text(error_mm.at("trials")), plain_text(point.at("trials"))),
            .value = error_mm.at("mean"),
            .unit = "mm",
            .goal = at_most(goal_mm)}));
      }
    }
  }
  return verdicts;
}

Json measure(Device& device, const SweepOptions& options) {
  const SweepPlan plan = plan_of(options);
  const int trials = plan.trials_each * static_cast<int>(vowels.size());
  Json document{{"touches", touches_per_trial}, {"trials", trials},
                {"points", Json::array()},      {"windows", ""},
                {"precisions", Json::array()},  {"fronts", Json::object()},
                {"bounds", Json::array()},      {"auto_rule", Json::object()},
                {"knees", Json::array()},       {"limits", Json::array()},
                {"verdicts", Json::array()}};
  print_head(Columns(run_columns()).first(printed_run_columns));
  for (const CellPlan& cells : plan.cells) {
    sweep_cells(device, plan, cells, document);
  }
  document["windows"] = window_sentence(document["points"]);
  document["fronts"] = fronts_of(document["points"], document["precisions"], trials);
  document["auto_rule"] = auto_rule_of(document["bounds"]);
  document["limits"] = measure_limits(device, plan);
  document["verdicts"] = verdicts_of(document["points"]);
  return document;
}

/// What follows the runs.
void print(const Json& document) {
  print_table(precision_columns(), document.at("precisions"));
  print_table(bounds_columns(), document.at("bounds"));
  fmt::print("\n{}\n", plain_text(document.at("auto_rule").at("sentence")));
  print_table(limit_columns(), document.at("limits"));
  fmt::print("\n");
  for (const Json& knee : document.at("knees")) {
    fmt::print("- {}\n", plain_text(knee.at("sentence")));
  }
  print_table(step_columns(), steps_of(document));
  fmt::print("\n{}\n", plain_text(document.at("windows")));
  print_table(verdict_columns(), document.at("verdicts"));
}

}  // namespace

void run_sweep(const SweepOptions& options, std::span<char* const> command_line) {
  require_at_least("--max-bins", options.max_bins, 1'000);
  if (options.own != OwnDataOptions{}) {
    return run_own_sweep(options, command_line);
  }
  require_at_least("--trials", options.trials, 1);
  CommandRun run(options,
                 {{"--json", options.json},
                  {"--html", options.html},
                  {"--plots", options.plots, chart_files(chart_names)}},
                 command_line);
  Json document = run.facts();
  Json measured;
  const double seconds = seconds_of([&] { measured = measure(run.device(), options); });
  document["seconds in all"] = std::round(10.0 * seconds) / 10.0;
  document.update(measured);
  print(document);
  run.write(options.json, document.dump(2) + "\n");
  run.write(options.html, page_of(document));
  if (!options.plots.empty()) {
    write_charts(charts_of(document), options.plots, chart_names);
  }
}

}  // namespace palpate::bench
