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
#include "letters.hpp"
#include "measurement.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/error.hpp"
#include "sweep_plan.hpp"
#include "sweep_result.hpp"
#include "sweep_words.hpp"

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

std::string mean_mm(const SweepPoint& point, PoseKind kind) {
  const std::optional<ErrorsOverTrials> errors = errors_over(point.errors, kind);
  return errors ? fmt::format("{:.3f}", errors->mean_mm) : std::string("-");
}

void print(const SweepPoint& point) {
  fmt::print(
      "{:<10} {:>5} {:>9} {:>6} {:>4} {:>10} {:>10} {:>8.1f} {:>6.1f} {:>8} {:>8} {:>8.3f} "
      "{:>9.1e}\n",
      point.filter, point.cell_mm, count_text(static_cast<double>(point.count)),
      point.errors.size(), point.full_trials, seconds_text(point.seconds_touch),
      seconds_text(point.seconds_unknown), static_cast<double>(point.device_bytes) / (1 << 20),
      100.0 * point.accuracy, mean_mm(point, PoseKind::mode), mean_mm(point, PoseKind::refined),
      point.calibration_error, point.deviation.largest);
  std::fflush(stdout);
}

/// Each of the particle filters at each of the counts.
void sweep_particles(Device& device, const LearnedLetters& learned, const SweepPlan& plan,
                     const CellPlan& cells, SweepResult& result) {
  for (const auto& [resampling, augmented] :
       {std::pair{Resampling::multinomial, false}, std::pair{Resampling::systematic, false},
        std::pair{Resampling::multinomial, true}}) {
    for (const int particles : cells.particles) {
      result.points.push_back(measure_particles(device, learned,
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
  const LearnedLetters learned = learn_letters(device, MapOptions{.cell_mm = cells.cell_mm});
  const std::vector<Recording> trials = trials_of(plan.trials_each);
  for (const BinCounts& bins : cells.lattices) {
    result.points.push_back(measure_histogram(
        device, learned, trials, plan.full_each(cells.cell_mm, bins), lattice_with(bins)));
    result.points.back().balanced = is_balanced(bins);
    print(result.points.back());
  }
  sweep_particles(device, learned, plan, cells, result);
  for (const BinCounts& bins : cells.compared) {
    for (Precision& precision :
         compare_paths(device, learned, trials.front(), lattice_with(bins))) {
      result.precisions.push_back(std::move(precision));
    }
  }
  if (!cells.lattices.empty()) {
    const PoseLattice balanced = balanced_lattice(lattice_with(goal_bins), learned.objects).lattice;
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
  fmt::print("{:<10} {:>5} {:>9} {:>6} {:>4} {:>10} {:>10} {:>8} {:>6} {:>8} {:>8} {:>8} {:>9}\n",
             "filter", "cells", "count", "trials", "full", "a touch", "unknown", "MiB", "right",
             "mode mm", "refined", "calibr.", "deviation");
  for (const CellPlan& cells : plan.cells) {
    sweep_cells(device, plan, cells, result);
  }
  result.limits = measure_limits(device, {.lattices = plan.limits,
                                          .trials_each = plan.trials_each,
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

  fmt::print("\n");
  for (const Precision& precision : result.precisions) {
    fmt::print(
        "{:>9} poses: {:8.3f} ns per pose, element and touch, largest deviation {:.1e} nats, by "
        "{}\n",
        count_text(static_cast<double>(precision.count)), precision.nanoseconds,
        precision.deviation.largest, precision.path);
  }
  for (const CellFinding& finding : result.findings) {
    fmt::print("{}\n", finding.sentence);
  }
  fmt::print("{}\n", window_sentence(result));
  for (const Limit& limit : result.limits) {
    fmt::print(
        "{}, {} elements, {} bins: {} mm by the mode, {} refined; {} and {} to {}; {} beyond "
        "the windows\n",
        limit.name, limit.elements, count_text(static_cast<double>(limit.count)),
        mean_text(errors_over(limit.errors, PoseKind::mode)),
        mean_text(errors_over(limit.errors, PoseKind::refined)),
        gain_text(result, limit, PoseKind::mode), gain_text(result, limit, PoseKind::refined),
        against_text(result, limit), limit.beyond);
  }
  for (const Measurement& verdict : result.verdicts) {
    fmt::print("{}: {:.3f} {}, at most {}: {}\n", verdict.name, verdict.value, verdict.unit,
               verdict.goal->value, verdict.reached() ? "reached" : "not reached");
  }
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
      AtomicFile file(std::filesystem::path(options.plots) / ("sweep_" + chart.name + ".svg"));
      commit(file, chart.file);
    }
  }
}

}  // namespace palpate::bench
