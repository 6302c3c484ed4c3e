#include <algorithm>
#include <cmath>
#include <random>

#include "accuracy.hpp"
#include "filter_run.hpp"
#include "pose_window.hpp"
#include "reference/reference.hpp"
#include "sweep_document.hpp"
#include "sweep_measurements.hpp"

namespace palpate::bench {

namespace {

/// What a run cost, as medians, and what it is worth. What only some runs have is null.
Json record_of(const FilterRun& run, double cell_mm) {
  std::vector<double> seconds_touch;    // from a touch to its estimate
  std::vector<double> seconds_unknown;  // of all touches of a trial with an estimate each
  int right = 0;
  double least_confidence = 1.0;
  PoseErrors errors;
  for (const RecognitionRecord& record : run.records) {
    double sum = 0.0;
    for (const RecognitionStep& step : record.trace) {
      seconds_touch.push_back(step.seconds);
      sum += step.seconds;
    }
    seconds_unknown.push_back(sum);
    right += *record.last().right ? 1 : 0;
    least_confidence = std::min(least_confidence, record.last().confidence());
    errors.add(record.last());
  }
  const std::size_t trials = run.records.size();
  Json record{{"filter", run.filter},
              {"cell_mm", cell_mm},
              {"count", run.count},
              {"bins", nullptr},
              {"balanced", false},
              {"path", run.path},
              {"full_trials", trials},
              {"seconds_per_touch", median(seconds_touch)},
              {"seconds_per_unknown", median(seconds_unknown)},
              {"seconds_refine", nullptr},
              {"device_bytes", run.device_bytes},
              {"accuracy", right / static_cast<double>(trials)},
              {"least_confidence", least_confidence},
              {"expected_calibration_error", calibration_of(run).expected_error},
              {"trials", trials},
              {"windows", nullptr}};
  set_errors(record, errors);
  record["nearest_bin_mm"] = nullptr;
  return record;
}

/// Replaces the record's errors by errors from windows of all trials, and adds how far apart the
/// two poses of a trial lie at the most, by the pose error. `full` are by the full posterior, of
/// the first trials of every letter, equally many of each.
void look_into_windows(Json& record, Device& device, std::span<const Hypothesis> letters,
                       std::span<const Recording> trials, const PoseLattice& lattice,
                       std::span<const RecognitionRecord> full) {
  const std::size_t each = trials.size() / letters.size();
  const std::size_t full_each = full.size() / letters.size();
  int compared = 0;
  double mode_mm = 0.0;
  double refined_mm = 0.0;
  PoseErrors errors;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const RecognitionStep step = estimate_in_window(device, letters, trials[i], lattice);
    errors.add(step);
    if (i % each >= full_each) {
      continue;
    }
    const RecognitionStep& same = full[i / each * full_each + i % each].last();
    if (same.error_mm) {
      const Body body = truth_of(letters, trials[i]).body;
      const auto apart_mm = [&body](const auto& a, const auto& b) {
        return pose_error_mm(body, 1, a.T_object_robot, b.T_object_robot);
      };
      ++compared;
      mode_mm = std::max(mode_mm, apart_mm(step.mode, same.mode));
      refined_mm = std::max(refined_mm, apart_mm(*step.refined, *same.refined));
    }
  }
  record["windows"] = {{"compared_trials", compared},
                       {"mode_difference_mm", mode_mm},
                       {"refined_difference_mm", refined_mm}};
  set_errors(record, errors);
}

/// Weights after one touch against the likelihood of each particle. Weights are relative, so both
/// sides are taken relative to the heaviest particle.
ErrorStatistics weight_deviation(Device& device, const std::vector<Hypothesis>& letters,
                                 const Touch& touch, const ParticleOptions& options) {
  ParticleFilter filter(device, letters, options);
  filter.update(touch);
  const std::vector<ParticleFilter::Particle> particles = filter.particles();
  const auto reference_of = [&](const ParticleFilter::Particle& particle) {
    return reference::log_likelihood(touch, particle.T_object_robot, letters[particle.object].map,
                                     options.contact);
  };
  const ParticleFilter::Particle& heaviest =
      *std::max_element(particles.begin(), particles.end(),
                        [](const auto& a, const auto& b) { return a.weight < b.weight; });
  const double heaviest_reference = reference_of(heaviest);
  std::mt19937_64 random(7);
  ErrorStatistics errors;
  for (std::size_t i = 0; i < sampled_bins * letters.size(); ++i) {
    const ParticleFilter::Particle& particle = particles[random() % particles.size()];
    errors.add(std::log(particle.weight / heaviest.weight) -
               (reference_of(particle) - heaviest_reference));
  }
  return errors;
}

}  // namespace

Json measure_histogram(Device& device, const std::vector<Hypothesis>& letters,
                       std::span<const Recording> trials, std::span<const Recording> full,
                       const BinCounts& bins) {
  const PoseLattice lattice = lattice_with(bins);
  const FilterRun run = run_filter(device, {letters, HistogramOptions{.lattice = lattice}}, full);
  Json record = record_of(run, letters.front().map.cell_mm);
  record["bins"] = bins;
  record["balanced"] = is_balanced(bins);
  std::vector<double> seconds_refine;
  for (const RecognitionRecord& trial : run.records) {
    seconds_refine.push_back(trial.last().refine_seconds);
  }
  record["seconds_refine"] = median(seconds_refine);
  if (full.size() < trials.size()) {
    look_into_windows(record, device, letters, trials, lattice, run.records);
  }
  double nearest_mm = 0.0;
  for (const Recording& trial : trials) {
    nearest_mm += nearest_bin_mm(lattice, truth_of(letters, trial));
  }
  record["nearest_bin_mm"] = nearest_mm / static_cast<double>(trials.size());
  const Touch touch = trials.front().touch(0);
  PoseHistogram histogram(device, letters, {.lattice = lattice});
  histogram.update(touch);
  record["deviation_nats"] = record_of(
      likelihood_errors(letters, ContactModel{}, lattice, std::span(&touch, 1), sampled_bins,
                        [&](int object) { return histogram.log_likelihood(object); }));
  return record;
}

Json measure_particles(Device& device, const std::vector<Hypothesis>& letters,
                       std::span<const Recording> trials, ParticleOptions options) {
  Json record =
      record_of(run_filter(device, {letters, options}, trials), letters.front().map.cell_mm);
  options.seed += trials.size();  // no trial's
  record["deviation_nats"] =
      record_of(weight_deviation(device, letters, trials.front().touch(0), options));
  return record;
}

}  // namespace palpate::bench
