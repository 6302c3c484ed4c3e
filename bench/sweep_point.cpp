#include "sweep_point.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "accuracy.hpp"
#include "filter_run.hpp"
#include "palpate/pose_histogram.hpp"
#include "reference.hpp"

namespace palpate::bench {

namespace {

SweepPoint point_of(const FilterRun& run, double cell_mm) {
  SweepPoint point{.filter = run.filter,
                   .cell_mm = cell_mm,
                   .count = run.count,
                   .path = run.path,
                   .full_trials = static_cast<int>(run.records.size()),
                   .device_bytes = run.device_bytes,
                   .calibration_error = calibration_of(run).expected_error};
  std::vector<double> seconds_touch;
  std::vector<double> seconds_unknown;
  for (const RecognitionRecord& record : run.records) {
    double sum = 0.0;
    for (const RecognitionStep& step : record.trace) {
      seconds_touch.push_back(step.seconds);
      sum += step.seconds;
    }
    seconds_unknown.push_back(sum);
    const RecognitionStep& last = record.last();
    point.errors.push_back(errors_of(last));
    point.accuracy += *last.right ? 1.0 : 0.0;
    point.least_confidence = std::min(point.least_confidence, last.confidence());
  }
  point.seconds_touch = median(seconds_touch);
  point.seconds_unknown = median(seconds_unknown);
  point.accuracy /= point.full_trials;
  return point;
}

/// Replaces the point's errors by errors from windows of all trials, and compares the two. `full`
/// are by the full posterior, of the first trials of every letter, equally many of each.
void look_into_windows(SweepPoint& point, Device& device, std::span<const Hypothesis> letters,
                       std::span<const Recording> trials, const PoseLattice& lattice,
                       std::span<const RecognitionRecord> full) {
  const std::size_t each = trials.size() / letters.size();
  const std::size_t full_each = full.size() / letters.size();
  WindowCheck check;
  point.errors.clear();
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const RecognitionStep step = estimate_in_window(device, letters, trials[i], lattice);
    point.errors.push_back(errors_of(step));
    if (i % each >= full_each) {
      continue;
    }
    const RecognitionStep& same = full[i / each * full_each + i % each].last();
    if (same.error_mm) {
      const Body body = body_of(letter_of(letters, trials[i]).map);
      ++check.trials;
      check.mode_mm = std::max(check.mode_mm, pose_error_mm(body, 1, step.mode.T_object_robot,
                                                            same.mode.T_object_robot));
      check.refined_mm = std::max(
          check.refined_mm,
          pose_error_mm(body, 1, step.refined->T_object_robot, same.refined->T_object_robot));
    }
  }
  point.window = check;
}

/// Weights after one touch against the likelihood of each particle. Weights are relative, so both
/// sides are taken relative to the heaviest particle.
Deviation weight_deviation(Device& device, const std::vector<Hypothesis>& letters,
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
  return deviation_of(errors);
}

}  // namespace

Deviation deviation_of(const ErrorStatistics& errors) {
  return {.largest = errors.largest(),
          .rms = errors.rms(),
          .samples = static_cast<int>(errors.count())};
}

SweepPoint measure_histogram(Device& device, const std::vector<Hypothesis>& letters,
                             std::span<const Recording> trials, std::span<const Recording> full,
                             const PoseLattice& lattice) {
  const FilterRun run = run_filter(device, {letters, HistogramOptions{.lattice = lattice}}, full);
  SweepPoint point = point_of(run, letters.front().map.cell_mm);
  point.bins = {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count};
  std::vector<double> seconds_refine;
  for (const RecognitionRecord& record : run.records) {
    seconds_refine.push_back(record.last().refine_seconds);
  }
  point.seconds_refine = median(seconds_refine);
  if (full.size() < trials.size()) {
    look_into_windows(point, device, letters, trials, lattice, run.records);
  }
  double nearest_mm = 0.0;
  for (const Recording& trial : trials) {
    nearest_mm += nearest_bin_mm(lattice, truth_of(letter_of(letters, trial), trial));
  }
  point.nearest_bin_mm = nearest_mm / static_cast<double>(trials.size());
  const Touch touch = trials.front().touch(0);
  PoseHistogram histogram(device, letters, {.lattice = lattice});
  histogram.update(touch);
  point.deviation = deviation_of(
      likelihood_errors(letters, ContactModel{}, lattice, std::span(&touch, 1), sampled_bins,
                        [&](int object) { return histogram.log_likelihood(object); }));
  return point;
}

SweepPoint measure_particles(Device& device, const std::vector<Hypothesis>& letters,
                             std::span<const Recording> trials, ParticleOptions options) {
  SweepPoint point =
      point_of(run_filter(device, {letters, options}, trials), letters.front().map.cell_mm);
  options.seed += trials.size();  // no trial's
  point.deviation = weight_deviation(device, letters, trials.front().touch(0), options);
  return point;
}

}  // namespace palpate::bench
