#include "experiment.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <system_error>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "atomic_file.hpp"
#include "comparison.hpp"
#include "experiment_result.hpp"
#include "gnuplot.hpp"
#include "letters.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/error.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t learned_seed = 1'000;  ///< of the letters' trials
constexpr std::uint64_t unlearned_seed = 100'000'000;
constexpr std::uint64_t particle_seed = 1;
constexpr int most_noisy_touches = 20;  ///< of an array that is not where it is reported

/// Before the minutes of work, so that a folder that cannot be is known at once.
void make_folder(const std::string& folder) {
  std::error_code error;
  if (!folder.empty() && !std::filesystem::create_directories(folder, error) && error) {
    throw Error(Fault::input, fmt::format("folder {}: {}; give one that can be written to", folder,
                                          error.message()));
  }
}

int least_one(const char* field, int value) {
  if (value < 1) {
    throw Error(Fault::input, fmt::format("{} = {}: give 1 or more", field, value));
  }
  return value;
}

ExperimentResult measure(Device& device, const ExperimentOptions& options, Report& report) {
  const int trials_each = least_one("--trials", options.trials.value_or(options.quick ? 4 : 10));
  const int touches = options.touches.value_or(options.quick ? 12 : 50);
  const std::vector<Recording> trials = make_trials(vowels, trials_each, touches, learned_seed);
  const LearnedLetters learned = learn_letters(device, MapOptions{});
  ExperimentResult result;
  for (const Recording& trial : trials) {
    result.true_objects.push_back(trial.truth->object);
  }
  const auto add = [&](FilterRun run) {
    report.add(case_of(run));
    result.runs.push_back(std::move(run));
  };
  const std::array table_1 = {lattice_of(5, 5, 4), lattice_of(10, 10, 10), lattice_of(25, 25, 16)};
  for (const PoseLattice& lattice : table_1) {
    add(run_histogram(device, learned, trials, lattice));
  }
  // As many as Table I's most, shaped by what a turn moves.
  const std::int64_t most_bins =
      table_1.back().bins() * static_cast<std::int64_t>(learned.objects.size());
  add(run_histogram(device, learned, trials,
                    balanced_lattice(table_1.back(), learned.objects, most_bins).lattice));
  const std::vector<int> counts =
      options.quick ? std::vector{1'000, 10'000} : std::vector{100, 1'000, 10'000};
  for (const bool augmented : {false, true}) {
    for (const int particles : counts) {
      add(run_particles(device, learned, trials,
                        ParticleOptions{.particles = particles,
                                        .region = table_1.back(),
                                        .augmented = augmented,
                                        .seed = particle_seed}));
    }
  }
  for (const auto& [histogram, particles] : equal_counts(result.runs)) {
    report.add(comparison_of(histogram, particles));
  }
  for (const SensorPoseNoise& noise : {SensorPoseNoise{1.0, 0.05}, SensorPoseNoise{2.0, 0.1}}) {
    const std::vector<Recording> noisy = make_trials(
        vowels, trials_each, std::min(touches, most_noisy_touches), learned_seed, noise);
    PoseNoiseRuns& runs = result.pose_noise.emplace_back();
    runs.noise = noise;
    for (const PoseLattice& lattice : {table_1[1], table_1[2]}) {
      runs.runs.push_back(run_histogram(device, learned, noisy, lattice));
    }
    runs.runs.push_back(run_particles(
        device, learned, noisy,
        ParticleOptions{
            .particles = counts.back(), .region = table_1.back(), .seed = particle_seed}));
    report.add(case_of(runs));
  }

  std::vector<int> none_touches;  // few, the paper's nine, many
  for (const int n : {3, 9, 25}) {
    if (n <= touches) {
      none_touches.push_back(n);
    }
  }
  if (none_touches.empty()) {
    none_touches.push_back(touches);
  }
  result.none =
      run_none(device, learned, trials,
               make_trials(unlearned_shapes, trials_each, none_touches.back(), unlearned_seed),
               table_1.back(), none_touches);
  for (const NoneRun& run : result.none) {
    report.add(case_of(run));
  }
  return result;
}

}  // namespace

void run_experiment(const ExperimentOptions& options, std::span<char* const> command_line) {
  std::unique_ptr<AtomicFile> file;
  if (!options.json.empty()) {
    file = std::make_unique<AtomicFile>(options.json);
  }
  make_folder(options.csv);
  make_folder(options.plots);
  if (!options.plots.empty()) {
    require_gnuplot();
  }
  Device device = Device::open(options.device);
  const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
  Report report({{"device", device.name()},
                 {"data", "simulated letters and sensor; the paper's recordings are not public"},
                 {"date", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", now)},
                 {"command line", fmt::format("{}", fmt::join(command_line, " "))}});
  const ExperimentResult result = measure(device, options, report);
  if (file) {
    nlohmann::ordered_json document = report.document();
    document.update(document_of(result));
    file->write(document.dump(2) + "\n");
    file->commit();
  }
  if (!options.csv.empty()) {
    write_tables(result, options.csv);
  }
  if (!options.plots.empty()) {
    draw_figures(result, options.plots);
  }
}

}  // namespace palpate::bench
