#include "sweep.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
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
#include "sweep_result.hpp"

namespace palpate::bench {

namespace {

constexpr int touches_per_trial = 15;
constexpr std::uint64_t trial_seed = 1'000;  ///< the experiment's
constexpr std::uint64_t particle_seed = 1;
// The goal's lattice: balanced, about a million bins.
constexpr std::array<int, 3> goal_bins = {64, 64, 244};
constexpr std::array<std::array<int, 3>, 3> table_1 = {{{5, 5, 4}, {10, 10, 10}, {25, 25, 16}}};
constexpr double goal_mode_mm = 0.3;
constexpr double goal_refined_mm = 0.2;

PoseLattice lattice_with(const std::array<int, 3>& bins) {
  return lattice_of(bins[0], bins[1], bins[2]);
}

/// A lattice of some number of bins in the proportions of another.
std::array<int, 3> scaled(const std::array<int, 3>& bins, double count) {
  const double whole = static_cast<double>(bins[0]) * bins[1] * bins[2];
  const double factor = std::cbrt(count / whole);
  std::array<int, 3> counts{};
  std::transform(bins.begin(), bins.end(), counts.begin(),
                 [&](int n) { return std::max(1, static_cast<int>(std::lround(factor * n))); });
  return counts;
}

std::int64_t product(const std::array<int, 3>& bins) {
  return std::int64_t{bins[0]} * bins[1] * bins[2];
}

/// Cells of one size and the lattices to try with their maps.
struct CellPlan {
  double cell_mm = 0.0;
  std::vector<std::array<int, 3>> lattices;
  std::vector<int> particles;
  std::vector<std::array<int, 3>> compared;  ///< with the baselines
};

/// Counts in the proportions of the goal's lattice and, for cells of 0.5 mm, the paper's Table I.
std::vector<CellPlan> plan_of(bool quick, std::int64_t max_bins) {
  std::vector<CellPlan> plans;
  if (quick) {
    plans = {{.cell_mm = 1.0,
              .lattices = {scaled(goal_bins, 1e3), scaled(goal_bins, 1e4), scaled(goal_bins, 1e5)},
              .particles = {},
              .compared = {}},
             {.cell_mm = 0.5,
              .lattices = {{5, 5, 4},
                           {10, 10, 10},
                           scaled(goal_bins, 1e2),
                           scaled(goal_bins, 1e3),
                           {25, 25, 16},
                           scaled(goal_bins, 1e4),
                           scaled(goal_bins, 1e5)},
              .particles = {1'000, 10'000},
              .compared = {{25, 25, 4}, {100, 100, 2}}}};
  } else {
    const std::vector<std::array<int, 3>> decades = {scaled(goal_bins, 1e2), scaled(goal_bins, 1e3),
                                                     scaled(goal_bins, 1e4), scaled(goal_bins, 1e5),
                                                     goal_bins};
    CellPlan coarse{.cell_mm = 1.0, .lattices = decades, .particles = {}, .compared = {}};
    CellPlan paper{.cell_mm = 0.5,
                   .lattices = {{5, 5, 4},
                                {10, 10, 10},
                                {25, 25, 16},
                                scaled(goal_bins, 3e4),
                                scaled(goal_bins, 3e5),
                                scaled(goal_bins, 3e6),
                                scaled(goal_bins, 1e7)},
                   .particles = {100, 1'000, 10'000, 100'000},
                   .compared = {{25, 25, 16}, {50, 50, 40}, {100, 100, 10}, {200, 200, 4}}};
    paper.lattices.insert(paper.lattices.end(), decades.begin(), decades.end());
    CellPlan fine{.cell_mm = 0.25, .lattices = decades, .particles = {}, .compared = {}};
    fine.lattices.push_back(scaled(goal_bins, 3e6));
    fine.lattices.push_back(scaled(goal_bins, 1e7));
    plans = {coarse, paper, fine};
  }
  for (CellPlan& plan : plans) {
    std::erase_if(plan.lattices, [&](const auto& bins) { return product(bins) > max_bins; });
    std::stable_sort(plan.lattices.begin(), plan.lattices.end(),
                     [](const auto& a, const auto& b) { return product(a) < product(b); });
  }
  return plans;
}

/// Trials per letter: enough for a stable mean where bins are few, as many as there is time for
/// where they are many. Cells other than 0.5 mm are only compared with each other.
int trials_each(const SweepOptions& options, double cell_mm, std::int64_t bins) {
  int trials = bins > 4'000'000 ? 1 : bins > 1'200'000 ? 2 : 10;
  if (options.quick) {
    trials = bins > 50'000 ? 1 : 4;
  } else if (cell_mm != 0.5) {
    trials = std::min(trials, bins > 500'000 ? 2 : 4);
  }
  return std::min(trials, options.trials.value_or(trials));
}

void print(const SweepPoint& point) {
  const auto mm = [](const std::optional<ErrorSummary>& error) {
    return error ? fmt::format("{:8.3f}", error->mean_mm) : std::string("       -");
  };
  fmt::print("{:<10} {:>5} {:>9} {:>6} {:>10} {:>10} {:>8.1f} {:>6.1f} {} {} {:>8.3f} {:>9.1e}\n",
             point.filter, point.cell_mm, count_text(static_cast<double>(point.count)),
             point.scores.size(), seconds_text(point.seconds_touch),
             seconds_text(point.seconds_unknown),
             static_cast<double>(point.device_bytes) / (1 << 20), 100.0 * point.last.accuracy,
             mm(point.last.error), mm(point.last.refined_error), point.calibration_error,
             point.deviation->largest);
  std::fflush(stdout);
}

SweepResult measure(Device& device, const SweepOptions& options) {
  const std::int64_t max_bins =
      options.max_bins.value_or(options.quick ? 100'000 : 10'000'000) * 11 / 10;
  SweepResult result{.objects = vowels.size(), .touches = touches_per_trial};
  const auto trials_of = [&](int each) {
    return make_trials(vowels, each, touches_per_trial, trial_seed);
  };
  fmt::print("{:<10} {:>5} {:>9} {:>6} {:>10} {:>10} {:>8} {:>6} {:>8} {:>8} {:>8} {:>9}\n",
             "filter", "cells", "count", "trials", "a touch", "unknown", "MiB", "right", "mode mm",
             "refined", "calibr.", "deviation");
  for (const CellPlan& plan : plan_of(options.quick, max_bins)) {
    const LearnedLetters learned = learn_letters(device, MapOptions{.cell_mm = plan.cell_mm});
    for (const std::array<int, 3>& bins : plan.lattices) {
      const PoseLattice lattice = lattice_with(bins);
      result.points.push_back(measure_histogram(
          device, learned, trials_of(trials_each(options, plan.cell_mm, lattice.bins())), lattice));
      result.points.back().balanced =
          std::find(table_1.begin(), table_1.end(), bins) == table_1.end();
      print(result.points.back());
    }
    for (const bool augmented : {false, true}) {
      for (const int particles : plan.particles) {
        result.points.push_back(measure_particles(device, learned,
                                                  trials_of(trials_each(options, plan.cell_mm, 0)),
                                                  {.particles = particles,
                                                   .region = lattice_with(goal_bins),
                                                   .augmented = augmented,
                                                   .seed = particle_seed}));
        const SweepPoint& point = result.points.back();
        print(point);
        if (!augmented) {
          const double evaluations = static_cast<double>(point.count * 36);
          result.precisions.push_back({.path = point.path,
                                       .count = point.count,
                                       .nanoseconds = 1e9 * point.seconds_touch / evaluations,
                                       .deviation = *point.deviation});
        }
      }
    }
    for (const std::array<int, 3>& bins : plan.compared) {
      for (Precision& precision :
           compare_paths(device, learned, trials_of(1).front(), 3, lattice_with(bins))) {
        result.precisions.push_back(std::move(precision));
      }
    }
    if (!plan.lattices.empty()) {
      const PoseLattice balanced =
          balanced_lattice(lattice_with(goal_bins), learned.objects).lattice;
      result.findings.push_back(
          find_knee(result, plan.cell_mm,
                    {balanced.x_mm.count, balanced.y_mm.count, balanced.theta_rad.count}));
    }
  }
  for (const SweepPoint& point : result.points) {
    if (point.bins == goal_bins && point.cell_mm == 0.5 && point.last.error) {
      const std::string where =
          fmt::format("{} x {} x {} bins, {} touches, {} trials", goal_bins[0], goal_bins[1],
                      goal_bins[2], touches_per_trial, point.scores.size());
      result.verdicts = {{"mean error by the mode, " + where, point.last.error->mean_mm, "mm",
                          at_most(goal_mode_mm)},
                         {"mean error refined, " + where, point.last.refined_error->mean_mm, "mm",
                          at_most(goal_refined_mm)}};
    }
  }
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
        "{:>9} poses: {:8.3f} ns per pose, element and touch, largest deviation {:.1e} nats "
        "per touch, by {}\n",
        count_text(static_cast<double>(precision.count)), precision.nanoseconds,
        precision.deviation.largest, precision.path);
  }
  for (const CellFinding& finding : result.findings) {
    fmt::print("{}\n", finding.sentence);
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
