#include "filter_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "letters.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::bench {

namespace {

std::optional<ErrorSummary> summary_of(std::span<const double> errors_mm) {
  if (errors_mm.empty()) {
    return {};
  }
  const double sum_mm = std::accumulate(errors_mm.begin(), errors_mm.end(), 0.0);
  return ErrorSummary{.mean_mm = sum_mm / static_cast<double>(errors_mm.size()),
                      .median_mm = median(errors_mm),
                      .p95_mm = quantile(errors_mm, 0.95)};
}

CurvePoint point_of(const FilterRun& run, std::size_t touch) {
  CurvePoint point{.touches = static_cast<int>(touch) + 1, .error = {}, .refined_error = {}};
  std::vector<double> errors_mm;
  std::vector<double> refined_errors_mm;
  int right = 0;
  for (const std::vector<Score>& trial : run.scores) {
    const Score& score = trial[touch];
    right += score.right ? 1 : 0;
    point.mean_confidence += score.confidence;
    if (score.error_mm) {
      errors_mm.push_back(*score.error_mm);
    }
    if (score.refined_error_mm) {
      refined_errors_mm.push_back(*score.refined_error_mm);
    }
  }
  const auto trials = static_cast<int>(run.scores.size());
  point.accuracy = static_cast<double>(right) / trials;
  point.accuracy_interval = wilson_interval(right, trials);
  point.mean_confidence /= trials;
  point.located = static_cast<int>(errors_mm.size());
  point.error = summary_of(errors_mm);
  point.refined_error = summary_of(refined_errors_mm);
  return point;
}

}  // namespace

FilterRun run_histogram(Device& device, const LearnedLetters& learned,
                        std::span<const Recording> trials, const PoseLattice& lattice) {
  FilterRun run{.filter = "histogram",
                .name = fmt::format("histogram {}x{}x{}", lattice.x_mm.count, lattice.y_mm.count,
                                    lattice.theta_rad.count),
                .count = lattice.bins(),
                .scores = {}};
  PoseHistogram histogram(device, learned.objects, HistogramOptions{.lattice = lattice});
  run.seconds = seconds_of([&] {
    for (const Recording& trial : trials) {
      std::vector<Score>& scores = run.scores.emplace_back();
      histogram.reset();
      for (const Touch& touch : all_touches(trial)) {
        histogram.update(touch);
        const Estimate estimate = histogram.estimate();
        Score& scored = scores.emplace_back(score(learned, estimate, *trial.truth));
        if (scored.error_mm) {
          scored.refined_error_mm =
              error_mm(learned, estimate.mode.object,
                       histogram.refine(estimate.mode).T_object_robot, *trial.truth);
        }
      }
    }
  });
  return run;
}

FilterRun run_particles(Device& device, const LearnedLetters& learned,
                        std::span<const Recording> trials, ParticleOptions options) {
  FilterRun run{.filter = options.augmented ? "augmented" : "particles",
                .name = fmt::format("{} {}", options.augmented ? "augmented MCL" : "particles",
                                    options.particles),
                .count = options.particles,
                .scores = {}};
  run.seconds = seconds_of([&] {
    for (const Recording& trial : trials) {
      // Not reset(), which would draw the same particles again.
      ParticleFilter particles(device, learned.objects, options);
      ++options.seed;
      std::vector<Score>& scores = run.scores.emplace_back();
      for (const Touch& touch : all_touches(trial)) {
        particles.update(touch);
        scores.push_back(score(learned, particles.estimate(), *trial.truth));
      }
    }
  });
  return run;
}

std::vector<CurvePoint> curve_of(const FilterRun& run) {
  std::vector<CurvePoint> curve;
  for (std::size_t touch = 0; touch < run.scores.front().size(); ++touch) {
    curve.push_back(point_of(run, touch));
  }
  return curve;
}

Calibration calibration_of(const FilterRun& run) {
  constexpr int width = 10;  // bins over [0, 1]
  std::array<Calibration::Bin, width> bins;
  int total = 0;
  for (const std::vector<Score>& trial : run.scores) {
    for (const Score& score : trial) {
      const int i = std::min(static_cast<int>(score.confidence * width), width - 1);
      ++bins[i].count;
      bins[i].mean_confidence += score.confidence;
      bins[i].fraction_right += score.right ? 1.0 : 0.0;
      ++total;
    }
  }
  Calibration calibration;
  for (int i = 0; i < width; ++i) {
    Calibration::Bin& bin = bins[i];
    if (bin.count == 0) {
      continue;
    }
    bin.lower = static_cast<double>(i) / width;
    bin.mean_confidence /= bin.count;
    bin.fraction_right /= bin.count;
    calibration.expected_error +=
        std::abs(bin.mean_confidence - bin.fraction_right) * bin.count / total;
    calibration.bins.push_back(bin);
  }
  return calibration;
}

}  // namespace palpate::bench
