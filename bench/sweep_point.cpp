#include "sweep_point.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <fmt/format.h>

#include "accuracy.hpp"
#include "filter_run.hpp"
#include "palpate/pose_histogram.hpp"
#include "reference.hpp"

namespace palpate::bench {

namespace {

/// What the trials of a filter leave behind.
struct Trials {
  FilterRun run;
  std::vector<double> seconds_touch;
  std::vector<double> seconds_unknown;

  /// Feeds a trial touch by touch. `step` takes a touch to an estimate.
  Estimate add(const LearnedLetters& learned, const Recording& trial,
               const std::function<Estimate(const Touch&)>& step) {
    std::vector<Score>& scores = run.scores.emplace_back();
    Estimate estimate;
    double sum = 0.0;
    for (const Touch& touch : all_touches(trial)) {
      seconds_touch.push_back(seconds_of([&] { estimate = step(touch); }));
      sum += seconds_touch.back();
      scores.push_back(score(learned, estimate, *trial.truth));
    }
    seconds_unknown.push_back(sum);
    return estimate;
  }

  void fill(SweepPoint& point) const {
    point.full_trials = static_cast<int>(run.scores.size());
    point.seconds_touch = median(seconds_touch);
    point.seconds_unknown = median(seconds_unknown);
    for (const std::vector<Score>& scores : run.scores) {
      const Score& last = scores.back();
      point.errors.push_back({.mode_mm = last.error_mm, .refined_mm = last.refined_error_mm});
      point.accuracy += last.right ? 1.0 : 0.0;
      point.least_confidence = std::min(point.least_confidence, last.confidence);
    }
    point.accuracy /= static_cast<double>(run.scores.size());
    point.calibration_error = calibration_of(run).expected_error;
  }
};

/// Poses by the full posterior.
struct FullPoses {
  Pose mode;
  Pose refined;
};

/// Puts errors from windows in the place of those of the full posterior, which they are held
/// against. `full` are of the first trials of every object, as many of each; none where the mode
/// has the wrong object.
void look_into_windows(SweepPoint& point, Device& device, const LearnedLetters& learned,
                       std::span<const Recording> trials, const PoseLattice& lattice,
                       std::span<const std::optional<FullPoses>> full) {
  const std::size_t each = trials.size() / learned.objects.size();
  const std::size_t full_each = full.size() / learned.objects.size();
  WindowCheck check;
  point.errors.clear();
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const WindowEstimate estimate = estimate_in_window(device, learned, trials[i], lattice);
    point.errors.push_back(estimate.errors);
    if (i % each >= full_each) {
      continue;
    }
    if (const std::optional<FullPoses>& same = full[i / each * full_each + i % each]) {
      const Body body = truth_of(learned, trials[i]).body;
      ++check.trials;
      check.mode_mm = std::max(check.mode_mm, pose_error_mm(body, 1, estimate.mode, same->mode));
      check.refined_mm =
          std::max(check.refined_mm, pose_error_mm(body, 1, estimate.refined, same->refined));
    }
  }
  point.window = check;
}

/// Weights after one touch against the likelihood of each particle. Weights are relative, so both
/// sides are taken relative to the heaviest particle.
Deviation weight_deviation(Device& device, const LearnedLetters& learned, const Touch& touch,
                           const ParticleOptions& options) {
  ParticleFilter filter(device, learned.objects, options);
  filter.update(touch);
  const std::vector<ParticleFilter::Particle> particles = filter.particles();
  const auto reference_of = [&](const ParticleFilter::Particle& particle) {
    return reference::log_likelihood(touch, particle.T_object_robot,
                                     learned.objects[particle.object].map, options.contact);
  };
  const ParticleFilter::Particle& heaviest =
      *std::max_element(particles.begin(), particles.end(),
                        [](const auto& a, const auto& b) { return a.weight < b.weight; });
  const double heaviest_reference = reference_of(heaviest);
  std::mt19937_64 random(7);
  ErrorStatistics errors;
  for (std::size_t i = 0; i < sampled_bins * learned.objects.size(); ++i) {
    const ParticleFilter::Particle& particle = particles[random() % particles.size()];
    errors.add(std::log(particle.weight / heaviest.weight) -
               (reference_of(particle) - heaviest_reference));
  }
  return deviation_of(errors, learned);
}

}  // namespace

Deviation deviation_of(const ErrorStatistics& errors, const LearnedLetters& learned) {
  return {.largest = errors.largest(),
          .rms = errors.rms(),
          .samples = sampled_bins * static_cast<int>(learned.objects.size())};
}

SweepPoint measure_histogram(Device& device, const LearnedLetters& learned,
                             std::span<const Recording> trials, int full_each,
                             const PoseLattice& lattice) {
  SweepPoint point{.filter = "histogram",
                   .cell_mm = learned.objects.front().map.cell_mm,
                   .count = lattice.bins(),
                   .bins = {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count}};
  PoseHistogram histogram(device, learned.objects, HistogramOptions{.lattice = lattice});
  point.path = fmt::format("{}", fmt::join(histogram.paths(), "; "));
  const std::size_t each = trials.size() / learned.objects.size();
  Trials results;
  std::vector<std::optional<FullPoses>> full;
  std::vector<double> seconds_refine;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    if (i % each >= static_cast<std::size_t>(full_each)) {
      continue;
    }
    histogram.reset();
    const Estimate estimate = results.add(learned, trials[i], [&](const Touch& touch) {
      histogram.update(touch);
      return histogram.estimate();
    });
    RefinedPose refined;
    seconds_refine.push_back(seconds_of([&] { refined = histogram.refine(estimate.mode); }));
    full.emplace_back();
    if (Score& scored = results.run.scores.back().back(); scored.error_mm) {
      scored.refined_error_mm =
          error_mm(learned, estimate.mode.object, refined.T_object_robot, *trials[i].truth);
      full.back() = FullPoses{estimate.mode.T_object_robot, refined.T_object_robot};
    }
  }
  results.fill(point);
  point.seconds_refine = median(seconds_refine);
  point.device_bytes = histogram.device_bytes();
  if (full.size() < trials.size()) {
    look_into_windows(point, device, learned, trials, lattice, full);
  }
  double nearest_mm = 0.0;
  for (const Recording& trial : trials) {
    nearest_mm += nearest_bin_mm(lattice, truth_of(learned, trial));
  }
  point.nearest_bin_mm = nearest_mm / static_cast<double>(trials.size());
  const Touch touch = trials.front().touch(0);
  histogram.reset();
  histogram.update(touch);
  point.deviation = deviation_of(
      likelihood_errors(learned.objects, ContactModel{}, lattice, std::span(&touch, 1),
                        sampled_bins, [&](int object) { return histogram.log_likelihood(object); }),
      learned);
  return point;
}

SweepPoint measure_particles(Device& device, const LearnedLetters& learned,
                             std::span<const Recording> trials, ParticleOptions options) {
  const bool systematic = options.resampling == Resampling::systematic;
  SweepPoint point{.filter = options.augmented ? "augmented"
                             : systematic      ? "systematic"
                                               : "particles",
                   .cell_mm = learned.objects.front().map.cell_mm,
                   .count = options.particles,
                   .path = "particles"};
  Trials results;
  for (const Recording& trial : trials) {
    // Not reset(), which would draw the same particles again.
    ParticleFilter particles(device, learned.objects, options);
    ++options.seed;
    results.add(learned, trial, [&](const Touch& touch) {
      particles.update(touch);
      return particles.estimate();
    });
    point.device_bytes = std::max(point.device_bytes, particles.device_bytes());
  }
  results.fill(point);
  point.deviation = weight_deviation(device, learned, trials.front().touch(0), options);
  return point;
}

}  // namespace palpate::bench
