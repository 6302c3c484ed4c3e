#include "sweep_point.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <fmt/format.h>

#include "accuracy.hpp"
#include "cases.hpp"
#include "cpu_loop.hpp"
#include "letters.hpp"
#include "measurement.hpp"
#include "one_bin_kernel.hpp"
#include "palpate/pose_histogram.hpp"
#include "reference.hpp"

namespace palpate::bench {

namespace {

constexpr int sampled_bins = 200;  ///< of every object, or particles
constexpr int repeats = 3;

Inputs inputs_of(Device& device, const LearnedLetters& learned) {
  Inputs inputs{.device = device,
                .device_name = {},
                .training = {},
                .letters = learned.objects,
                .model = {},
                .unknowns = {}};
  inputs.model.prior = learned.objects.front().map.prior;
  return inputs;
}

Deviation per_touch(const ErrorStatistics& errors, std::size_t touches, int samples) {
  const auto n = static_cast<double>(touches);
  return {.largest = errors.largest() / n, .rms = errors.rms() / n, .samples = samples};
}

Deviation deviation_of(const Inputs& inputs, const PoseLattice& lattice,
                       std::span<const Touch> touches,
                       const std::function<std::vector<double>(int object)>& log_likelihood) {
  return per_touch(likelihood_errors(inputs, lattice, touches, sampled_bins, log_likelihood),
                   touches.size(), sampled_bins * static_cast<int>(inputs.letters.size()));
}

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
    point.seconds_touch = median(seconds_touch);
    point.seconds_unknown = median(seconds_unknown);
    for (const std::vector<Score>& scores : run.scores) {
      point.scores.push_back(scores.back());
    }
    point.last = curve_of(run).back();
    point.calibration_error = calibration_of(run).expected_error;
  }
};

double nearest_centre(const Axis& axis, double value) {
  const double i = std::floor((value - axis.lower) / axis.step());
  return axis.centre(static_cast<int>(std::clamp(i, 0.0, axis.count - 1.0)));
}

/// Mean error of the bins that hold the true poses. For lattices about the robot's origin and over
/// the full circle, as all of Sec. IV are.
double nearest_bin_mm(const LearnedLetters& learned, std::span<const Recording> trials,
                      const PoseLattice& lattice) {
  double sum_mm = 0.0;
  for (const Recording& trial : trials) {
    const Truth& truth = *trial.truth;
    const auto object = std::find_if(
        learned.objects.begin(), learned.objects.end(),
        [&](const Hypothesis& hypothesis) { return hypothesis.map.label == truth.object; });
    const Axis& theta = lattice.theta_rad;
    const double turn = theta.upper - theta.lower;
    const double theta_rad = truth.T_object_robot.theta_rad;
    const Pose nearest = lattice.T_object_robot(
        nearest_centre(lattice.x_mm, truth.T_object_robot.translation_mm.x),
        nearest_centre(lattice.y_mm, truth.T_object_robot.translation_mm.y),
        nearest_centre(theta, theta_rad - turn * std::floor((theta_rad - theta.lower) / turn)));
    sum_mm += error_mm(learned, static_cast<int>(object - learned.objects.begin()), nearest, truth);
  }
  return sum_mm / static_cast<double>(trials.size());
}

/// Weights after one touch against the likelihood of each particle. Weights are relative, so both
/// sides are taken relative to the heaviest particle.
Deviation weight_deviation(Device& device, const LearnedLetters& learned, const Touch& touch,
                           const ParticleOptions& options) {
  ParticleFilter filter(device, learned.objects, options);
  filter.update(touch);
  const std::vector<ParticleFilter::Particle> particles = filter.particles();
  const ContactLikelihood model = inputs_of(device, learned).model;
  const auto reference_of = [&](const ParticleFilter::Particle& particle) {
    return reference::log_likelihood(touch, particle.T_object_robot,
                                     learned.objects[particle.object].map, options.classifier,
                                     model);
  };
  const ParticleFilter::Particle& heaviest =
      *std::max_element(particles.begin(), particles.end(),
                        [](const auto& a, const auto& b) { return a.weight < b.weight; });
  const double heaviest_reference = reference_of(heaviest);
  const int samples = sampled_bins * static_cast<int>(learned.objects.size());
  std::mt19937_64 random(7);
  ErrorStatistics errors;
  for (int i = 0; i < samples; ++i) {
    const ParticleFilter::Particle& particle = particles[random() % particles.size()];
    errors.add(std::log(particle.weight / heaviest.weight) -
               (reference_of(particle) - heaviest_reference));
  }
  return per_touch(errors, 1, samples);
}

std::string joined(const std::vector<std::string>& texts) {
  return fmt::format("{}", fmt::join(texts, "; "));
}

}  // namespace

SweepPoint measure_histogram(Device& device, const LearnedLetters& learned,
                             std::span<const Recording> trials, const PoseLattice& lattice) {
  SweepPoint point{.filter = "histogram",
                   .cell_mm = learned.objects.front().map.cell_mm,
                   .count = lattice.bins(),
                   .bins = {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count}};
  PoseHistogram histogram(device, learned.objects, HistogramOptions{.lattice = lattice});
  point.path = joined(histogram.paths());
  Trials results;
  for (const Recording& trial : trials) {
    histogram.reset();
    const Estimate estimate = results.add(learned, trial, [&](const Touch& touch) {
      histogram.update(touch);
      return histogram.estimate();
    });
    if (Score& scored = results.run.scores.back().back(); scored.error_mm) {
      scored.refined_error_mm =
          error_mm(learned, estimate.mode.object, histogram.refine(estimate.mode).T_object_robot,
                   *trial.truth);
    }
  }
  results.fill(point);
  point.device_bytes = histogram.device_bytes();
  point.nearest_bin_mm = nearest_bin_mm(learned, trials, lattice);
  point.deviation = deviation_of(inputs_of(device, learned), lattice, all_touches(trials.back()),
                                 [&](int object) { return histogram.log_likelihood(object); });
  return point;
}

SweepPoint measure_particles(Device& device, const LearnedLetters& learned,
                             std::span<const Recording> trials, ParticleOptions options) {
  SweepPoint point{.filter = options.augmented ? "augmented" : "particles",
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
    point.device_bytes = particles.device_bytes();
  }
  results.fill(point);
  point.deviation = weight_deviation(device, learned, trials.front().touch(0), options);
  return point;
}

std::vector<Precision> compare_paths(Device& device, const LearnedLetters& learned,
                                     const Recording& unknown, int touches,
                                     const PoseLattice& lattice) {
  const Inputs inputs = inputs_of(device, learned);
  const std::vector<Touch> first = unknown.touches(0, static_cast<std::size_t>(touches));
  PoseHistogram histogram(device, learned.objects, HistogramOptions{.lattice = lattice});
  OneBinKernel one_bin(device, inputs.letters, lattice, inputs.model);
  CpuLoop cpu_loop(inputs.letters, lattice, inputs.model);
  const std::function<void()> contenders[] = {
      [&] { histogram.update(first); },
      [&] { one_bin.update(first); },
      [&] { cpu_loop.update(first); },
  };
  for (const auto& contender : contenders) {
    contender();
  }
  const Deviation deviations[] = {
      deviation_of(inputs, lattice, first,
                   [&](int object) { return histogram.log_likelihood(object); }),
      deviation_of(inputs, lattice, first,
                   [&](int object) { return one_bin.log_likelihood(object); }),
      deviation_of(inputs, lattice, first,
                   [&](int object) { return cpu_loop.log_likelihood(object); }),
  };
  const std::string names[] = {joined(histogram.paths()), "one-bin kernel", "CPU loop"};
  const std::vector<std::vector<double>> seconds = interleave(contenders, repeats);
  const double evaluations = static_cast<double>(lattice.bins()) *
                             static_cast<double>(inputs.letters.size() * unknown.elements()) *
                             touches;
  std::vector<Precision> compared;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    compared.push_back({.path = names[i],
                        .count = lattice.bins(),
                        .nanoseconds = 1e9 * median(seconds[i]) / evaluations,
                        .deviation = deviations[i]});
  }
  return compared;
}

}  // namespace palpate::bench
