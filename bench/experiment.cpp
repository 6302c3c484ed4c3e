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
#include "experiment_result.hpp"
#include "gnuplot.hpp"
#include "letters.hpp"
#include "measurement.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/error.hpp"
#include "published.hpp"
#include "report.hpp"

namespace palpate::bench {

namespace {

constexpr std::uint64_t learned_seed = 1'000;  ///< of the letters' trials
constexpr std::uint64_t unlearned_seed = 100'000'000;
constexpr std::uint64_t particle_seed = 1;

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

double percent(double fraction) { return 100.0 * fraction; }

/// The least accuracy from some touch on.
double least_accuracy_from(std::span<const CurvePoint> curve, int touches) {
  double least = 1.0;
  for (const CurvePoint& point : curve.subspan(touches - 1)) {
    least = std::min(least, point.accuracy);
  }
  return least;
}

/// Touches from which the accuracy is 100 % to the end; one more than there are where it never is.
int touches_to_certainty(std::span<const CurvePoint> curve) {
  int touches = static_cast<int>(curve.size()) + 1;
  while (touches > 1 && curve[touches - 2].accuracy == 1.0) {
    --touches;
  }
  return touches;
}

Case case_of(const FilterRun& run) {
  const std::vector<CurvePoint> curve = curve_of(run);
  const CurvePoint& last = curve.back();
  Case result{.name = run.name,
              .facts = {{"trials", run.scores.size()},
                        {"touches", last.touches},
                        {"seconds", std::round(10.0 * run.seconds) / 10.0}},
              .measurements = {{"accuracy at the end", percent(last.accuracy), "%"}}};
  const auto add = [&](Measurement measurement) {
    result.measurements.push_back(std::move(measurement));
  };
  if (const int touches = touches_to_certainty(curve); touches <= last.touches) {
    add({"right in every trial from", static_cast<double>(touches), "touches on"});
  }
  // Balanced bins are as many as their whole numbers along each axis allow.
  const bool ten_thousand = run.filter == "histogram" && run.count > 1'000;
  const int known_after = run.filter != "histogram" ? 0
                          : ten_thousand            ? published::bins_10000_know_after
                          : run.count == 1'000      ? published::bins_1000_know_after
                                                    : 0;
  if (known_after > 0 && known_after <= last.touches) {
    add({fmt::format("least accuracy from touch {} on", known_after),
         percent(least_accuracy_from(curve, known_after)), "%", at_least(100.0)});
  }
  if (last.error) {
    add({"mean error at the end", last.error->mean_mm, "mm",
         ten_thousand ? std::optional(at_most(published::error_mm)) : std::nullopt});
    add({"median error at the end", last.error->median_mm, "mm"});
    add({"95th percentile of the error at the end", last.error->p95_mm, "mm"});
  }
  if (last.refined_error) {
    add({"mean error at the end, refined", last.refined_error->mean_mm, "mm"});
    add({"95th percentile at the end, refined", last.refined_error->p95_mm, "mm"});
  }
  add({"expected calibration error", percent(calibration_of(run).expected_error), "%"});
  return result;
}

/// At the end of the trials, filter by filter of one size.
Case comparison_of(const std::vector<FilterRun>& runs) {
  Case result{.name = "histogram against particles",
              .facts = {{"equal count",
                         "bins per object, of which there are five; particles in "
                         "all"}}};
  for (const FilterRun& particles : runs) {
    const auto histogram = std::find_if(runs.begin(), runs.end(), [&](const FilterRun& run) {
      return run.filter == "histogram" && run.count == particles.count;
    });
    if (particles.filter == "histogram" || histogram == runs.end()) {
      continue;
    }
    const CurvePoint ahead = curve_of(*histogram).back();
    const CurvePoint behind = curve_of(particles).back();
    result.measurements.push_back({fmt::format("accuracy ahead of {}", particles.name),
                                   percent(ahead.accuracy - behind.accuracy), "% points",
                                   at_least(0.0)});
    if (ahead.error && behind.error) {
      result.measurements.push_back({fmt::format("mean error less than {}'s", particles.name),
                                     behind.error->mean_mm - ahead.error->mean_mm, "mm",
                                     at_least(0.0)});
    }
  }
  return result;
}

/// "None" at even odds, and at the largest weight that loses no learned object.
Case case_of(const NoneRun& run) {
  const double safe =
      *std::min_element(run.learned_log10_weight.begin(), run.learned_log10_weight.end());
  return {
      .name = fmt::format("none of these, {} touches", run.touches),
      .facts = {{"learned", run.learned_log10_weight.size()},
                {"never learned", run.unlearned_log10_weight.size()}},
      .measurements = {
          {"called none at weight 1: never learned", percent(run.noticed(0.0)), "%"},
          {"called none at weight 1: learned", percent(run.lost(0.0)), "%"},
          {"largest weight that loses no learned one", safe, "log10"},
          {"never learned, called none at that weight", percent(run.noticed(safe)), "%"},
          {"unlearned turn to none before learned ones", percent(run.separation()), "% of pairs"}}};
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
  report.add(comparison_of(result.runs));

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
