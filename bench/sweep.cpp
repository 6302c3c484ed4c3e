#include "sweep.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <system_error>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "atomic_file.hpp"
#include "chart_file.hpp"
#include "command_files.hpp"
#include "letters.hpp"
#include "measurement.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/error.hpp"
#include "sweep_plan.hpp"
#include "sweep_result.hpp"
#include "sweep_words.hpp"
#include "trials.hpp"

namespace palpate::bench {

namespace {

constexpr int touches_per_trial = 15;
constexpr std::uint64_t trial_seed = 1'000;  ///< the experiment's
constexpr std::uint64_t particle_seed = 1;
constexpr double goal_mode_mm = 0.3;
constexpr double goal_refined_mm = 0.2;

std::vector<Recording> trials_of(int each) {
  return make_trials(vowels, each, touches_per_trial, trial_seed);
}

// What is printed is Markdown.

void print_heads(const std::vector<std::string>& heads) {
  fmt::print("\n| {} |\n|:--|", fmt::join(heads, " | "));
  for (std::size_t i = 1; i < heads.size(); ++i) {
    fmt::print("--:|");
  }
  fmt::print("\n");
}

void print_row(const std::vector<std::string>& cells) {
  fmt::print("| {} |\n", fmt::join(cells, " | "));
  std::fflush(stdout);
}

std::string text_of(const std::optional<double>& value) {
  return value ? fmt::format("{:.3f}", *value) : std::string("–");
}

void print(const SweepPoint& point) {
  const auto mode = errors_over(point.errors, PoseKind::mode);
  const auto refined = errors_over(point.errors, PoseKind::refined);
  print_row({point.filter == "histogram"
                 ? fmt::format("histogram {}x{}x{}", point.bins[0], point.bins[1], point.bins[2])
                 : point.filter,
             fmt::format("{}", point.cell_mm), count_text(static_cast<double>(point.count)),
             fmt::format("{}", point.full_trials), seconds_text(point.seconds_touch),
             seconds_text(point.seconds_unknown),
             point.seconds_refine ? seconds_text(*point.seconds_refine) : "–",
             fmt::format("{:.1f}", static_cast<double>(point.device_bytes) / (1 << 20)),
             fmt::format("{:.0f}", 100.0 * point.accuracy),
             fmt::format("{:.3f}", point.calibration_error),
             fmt::format("{} of {}", mode ? mode->trials : 0, point.errors.size()), mean_text(mode),
             text_of(mode ? mode->p95_mm : std::nullopt), mean_text(refined),
             text_of(refined ? refined->p95_mm : std::nullopt), text_of(point.nearest_bin_mm),
             fmt::format("{:.1e}", point.deviation.largest),
             fmt::format("{:.1e}", point.deviation.rms)});
}

void print(const SweepResult& result) {
  print_heads({"way", "bins", "ns per pose, element and touch", "largest", "RMS"});
  for (const Precision& precision : result.precisions) {
    print_row({precision.path, count_text(static_cast<double>(precision.count)),
               fmt::format("{:.2f}", precision.nanoseconds),
               fmt::format("{:.1e}", precision.deviation.largest),
               fmt::format("{:.1e}", precision.deviation.rms)});
  }
  print_heads({"otherwise", "elements", "bins", "mode, mm", "refined, mm", "against",
               "mode: difference", "refined: difference"});
  for (const Limit& limit : result.limits) {
    print_row({limit.name, fmt::format("{}", limit.elements),
               count_text(static_cast<double>(limit.count)),
               mean_text(errors_over(limit.errors, PoseKind::mode)),
               mean_text(errors_over(limit.errors, PoseKind::refined)), against_text(result, limit),
               difference_text(result, limit, PoseKind::mode),
               difference_text(result, limit, PoseKind::refined)});
  }
  fmt::print("\n");
  for (const CellFinding& finding : result.findings) {
    fmt::print("- {}\n", finding.sentence);
  }
  fmt::print("\n{}\n", window_sentence(result));
  if (!result.verdicts.empty()) {
    print_heads({"goal", "mm", "", "reached"});
  }
  for (const Measurement& verdict : result.verdicts) {
    print_row({verdict.name, fmt::format("{:.3f}", verdict.value),
               fmt::format("≤ {}", verdict.goal->value), verdict.reached() ? "yes" : "no"});
  }
}

/// Each of the particle filters at each of the counts.
void sweep_particles(Device& device, const std::vector<Hypothesis>& letters, const SweepPlan& plan,
                     const CellPlan& cells, SweepResult& result) {
  for (const auto& [resampling, augmented] :
       {std::pair{Resampling::multinomial, false}, std::pair{Resampling::systematic, false},
        std::pair{Resampling::multinomial, true}}) {
    for (const int particles : cells.particles) {
      result.points.push_back(measure_particles(device, letters,
                                                trials_of(plan.particle_trials_each(particles)),
                                                {.particles = particles,
                                                 .region = lattice_with(goal_bins),
                                                 .resampling = resampling,
                                                 .augmented = augmented,
                                                 .seed = particle_seed}));
      print(result.points.back());
    }
  }
}

void sweep_cells(Device& device, const SweepPlan& plan, const CellPlan& cells,
                 SweepResult& result) {
  const std::vector<Hypothesis> letters =
      letter_maps(device, training_recordings(), MapOptions{.cell_mm = cells.cell_mm});
  const std::vector<Recording> trials = trials_of(plan.trials_each);
  for (const BinCounts& bins : cells.lattices) {
    result.points.push_back(measure_histogram(device, letters, trials,
                                              trials_of(plan.full_each(cells.cell_mm, bins)),
                                              lattice_with(bins)));
    result.points.back().balanced = is_balanced(bins);
    print(result.points.back());
  }
  sweep_particles(device, letters, plan, cells, result);
  for (const BinCounts& bins : cells.compared) {
    for (Precision& precision :
         compare_paths(device, letters, trials.front(), lattice_with(bins))) {
      result.precisions.push_back(std::move(precision));
    }
  }
  if (!cells.lattices.empty()) {
    const PoseLattice balanced = balanced_lattice(lattice_with(goal_bins), letters).lattice;
    result.findings.push_back(
        find_knee(result, cells.cell_mm,
                  {balanced.x_mm.count, balanced.y_mm.count, balanced.theta_rad.count}));
  }
}

void judge(SweepResult& result) {
  for (const SweepPoint& point : result.points) {
    const auto mode = errors_over(point.errors, PoseKind::mode);
    const auto refined = errors_over(point.errors, PoseKind::refined);
    if (point.bins == goal_bins && point.cell_mm == goal_cell_mm && mode && refined) {
      const std::string where =
          fmt::format("{} x {} x {} bins, {} touches, {} of {} trials", goal_bins[0], goal_bins[1],
                      goal_bins[2], touches_per_trial, mode->trials, point.errors.size());
      result.verdicts = {
          {"mean error by the mode, " + where, mode->mean_mm, "mm", at_most(goal_mode_mm)},
          {"mean error refined, " + where, refined->mean_mm, "mm", at_most(goal_refined_mm)}};
    }
  }
}

SweepResult measure(Device& device, const SweepOptions& options) {
  const SweepPlan plan = plan_of(options);
  SweepResult result{.trials = plan.trials_each * static_cast<int>(vowels.size()),
                     .touches = touches_per_trial};
  print_heads({"filter", "cells, mm", "count", "in full", "per touch", "per unknown",
               "refined pose", "MiB", "right, %", "calibration error", "located", "mode: mean, mm",
               "95 %", "refined: mean, mm", "95 %", "nearest bin, mm", "deviation, nats: largest",
               "RMS"});
  for (const CellPlan& cells : plan.cells) {
    sweep_cells(device, plan, cells, result);
  }
  result.limits = measure_limits(device, {.lattices = plan.limits,
                                          .trials_each = plan.limit_trials_each,
                                          .touches = touches_per_trial,
                                          .seed = trial_seed,
                                          .quick = options.quick});
  judge(result);
  return result;
}

void require_at_least(const char* flag, const std::optional<std::int64_t>& value,
                      std::int64_t least) {
  if (value && *value < least) {
    throw Error(Fault::input, fmt::format("{} = {}: give {} or more", flag, *value, least));
  }
}

/// Of a chart's files, without their endings.
std::string file_name(const std::string& chart) { return "sweep_" + chart; }

void require_distinct_outputs(const SweepOptions& options) {
  CommandFiles files;
  if (!options.json.empty()) {
    files.writes("--json", options.json);
  }
  if (!options.html.empty()) {
    files.writes("--html", options.html);
  }
  if (!options.plots.empty()) {
    for (const char* chart : chart_names) {
      for (const std::string& file : chart_files(file_name(chart))) {
        files.writes("--plots", std::filesystem::path(options.plots) / file);
      }
    }
  }
  files.require_distinct();
}

std::unique_ptr<AtomicFile> output(const std::string& path) {
  return path.empty() ? nullptr : std::make_unique<AtomicFile>(path);
}

void commit(AtomicFile& file, const std::string& content) {
  file.write(content);
  file.commit();
}

}  // namespace

void run_sweep(const SweepOptions& options, std::span<char* const> command_line) {
  // Before the minutes of work, so that what cannot be is known at once.
  require_at_least("--max-bins", options.max_bins, 1'000);
  require_at_least("--trials", options.trials, 1);
  require_distinct_outputs(options);
  const std::unique_ptr<AtomicFile> json = output(options.json);
  const std::unique_ptr<AtomicFile> html = output(options.html);
  if (std::error_code error; !options.plots.empty() &&
                             !std::filesystem::create_directories(options.plots, error) && error) {
    throw Error(Fault::input, fmt::format("folder {}: {}; give one that can be written to",
                                          options.plots, error.message()));
  }
  Device device = Device::open(options.device);
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  nlohmann::ordered_json facts{
      {"device", device.name()},
      {"host threads", std::thread::hardware_concurrency()},
      {"compiler", PALPATE_COMPILER},
      {"data", "simulated letters and sensor; the paper's recordings are not public"},
      {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", now)},
      {"command line", fmt::format("{}", fmt::join(command_line, " "))}};
  SweepResult result;
  const double seconds = seconds_of([&] { result = measure(device, options); });
  facts["seconds in all"] = std::round(10.0 * seconds) / 10.0;

  print(result);
  if (json) {
    nlohmann::ordered_json document = facts;
    document.update(document_of(result));
    commit(*json, document.dump(2) + "\n");
  }
  if (html) {
    commit(*html, page_of(result, facts));
  }
  if (!options.plots.empty()) {
    for (const NamedChart& chart : charts_of(result)) {
      write_chart(chart.chart, options.plots, file_name(chart.name));
    }
  }
}

}  // namespace palpate::bench
