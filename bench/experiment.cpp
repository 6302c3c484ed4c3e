#include <algorithm>
#include <array>

#include "command_run.hpp"
#include "experiment_result.hpp"
#include "letters.hpp"
#include "palpate/balanced_lattice.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t learned_seed = 1'000;  ///< of the letters' trials
constexpr std::uint64_t particle_seed = 1;

constexpr int most_particles = 10'000;

/// Table I's bins per object: 100, 1,000 and 10,000.
std::array<PoseLattice, 3> table_1() {
  return {lattice_of(5, 5, 4), lattice_of(10, 10, 10), lattice_of(25, 25, 16)};
}

FilterOptions particles_of(int count, bool augmented) {
  return ParticleOptions{.particles = count,
                         .region = table_1().back(),
                         .augmented = augmented,
                         .seed = particle_seed};
}

/// The trials' letters again, with the array displaced.
std::vector<PoseNoiseRuns> measure_pose_noise(Device& device,
                                              const std::vector<Hypothesis>& letters,
                                              int trials_each, int touches) {
  constexpr int most_touches = 20;
  std::vector<PoseNoiseRuns> levels;
  for (const SensorPoseNoise& noise : {SensorPoseNoise{1.0, 0.05}, SensorPoseNoise{2.0, 0.1}}) {
    const std::vector<Recording> trials = make_trials(
        vowels, trials_each, std::min(touches, most_touches), learned_seed, {.pose_noise = noise});
    PoseNoiseRuns& level = levels.emplace_back();
    level.noise = noise;
    const std::array lattices = table_1();
    for (const FilterOptions& filter : {FilterOptions(HistogramOptions{.lattice = lattices[1]}),
                                        FilterOptions(HistogramOptions{.lattice = lattices[2]}),
                                        particles_of(most_particles, false)}) {
      level.runs.push_back(run_filter(device, {letters, filter}, trials));
    }
  }
  return levels;
}

ExperimentResult measure(Device& device, const ExperimentOptions& options, Report& report) {
  require_at_least("--trials", options.trials, 1);
  const int trials_each = options.trials.value_or(options.quick ? 4 : 10);
  const int touches = options.touches.value_or(options.quick ? 12 : 50);
  const std::vector<Recording> trials = make_trials(vowels, trials_each, touches, learned_seed);
  const std::vector<Hypothesis> letters = letter_maps(device, training_recordings(), MapOptions{});
  ExperimentResult result;
  const auto add = [&](const FilterOptions& filter) {
    result.runs.push_back(run_filter(device, {letters, filter}, trials));
    report.add(case_of(result.runs.back()));
  };
  const std::array lattices = table_1();
  for (const PoseLattice& lattice : lattices) {
    add(HistogramOptions{.lattice = lattice});
  }
  // As many bins as Table I's most, shaped by what a turn moves.
  const std::int64_t most_bins = lattices.back().bins() * static_cast<std::int64_t>(letters.size());
  add(HistogramOptions{
      .lattice = balanced_lattice(lattices.back(), letters, most_bins, BinWidth::fine).lattice});
  for (const bool augmented : {false, true}) {
    for (const int count : {100, 1'000, most_particles}) {
      if (!options.quick || count > 100) {
        add(particles_of(count, augmented));
      }
    }
  }
  for (const auto& [histogram, particles] : equal_counts(result.runs)) {
    report.add(comparison_of(histogram, particles));
  }
  result.pose_noise = measure_pose_noise(device, letters, trials_each, touches);
  for (const PoseNoiseRuns& runs : result.pose_noise) {
    report.add(case_of(runs));
  }
  return result;
}

}  // namespace

void run_experiment(const ExperimentOptions& options, std::span<char* const> command_line) {
  CommandRun run(options,
                 {{"--json", options.json},
                  {"--csv", options.csv, table_files()},
                  {"--plots", options.plots, figure_files()}},
                 command_line);
  Report report(run.facts());
  const ExperimentResult result = measure(run.device(), options, report);
  Json document = report.document();
  document.update(document_of(result));
  run.write(options.json, document.dump(2) + "\n");
  if (!options.csv.empty()) {
    write_tables(result, options.csv);
  }
  if (!options.plots.empty()) {
    draw_figures(document, options.plots);
  }
}

}  // namespace palpate::bench
