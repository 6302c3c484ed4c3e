#include "filter_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

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
  for (const RecognitionRecord& record : run.records) {
    const RecognitionStep& step = record.trace[touch];
    right += *step.right ? 1 : 0;
    point.mean_confidence += step.confidence();
    if (step.error_mm) {
      errors_mm.push_back(*step.error_mm);
    }
    if (step.refined_error_mm) {
      refined_errors_mm.push_back(*step.refined_error_mm);
    }
  }
  const auto trials = static_cast<int>(run.records.size());
  point.accuracy = static_cast<double>(right) / trials;
  point.accuracy_interval = wilson_interval(right, trials);
  point.mean_confidence /= trials;
  point.located = static_cast<int>(errors_mm.size());
  point.error = summary_of(errors_mm);
  point.refined_error = summary_of(refined_errors_mm);
  return point;
}

std::string filter_name(const FilterOptions& filter) {
  const auto* particles = std::get_if<ParticleOptions>(&filter);
  return particles == nullptr                              ? "histogram"
         : particles->augmented                            ? "augmented"
         : particles->resampling == Resampling::systematic ? "systematic"
                                                           : "particles";
}

}  // namespace

FilterRun run_filter(Device& device, RecognitionTask task, std::span<const Recording> trials) {
  FilterRun run{.filter = filter_name(task.filter), .name = {}, .records = {}};
  Recogniser recogniser(device, task);
  auto* particles = std::get_if<ParticleOptions>(&task.filter);
  if (particles != nullptr) {
    run.path = "particles";
    run.count = particles->particles;
    run.name = fmt::format("{} {}", particles->augmented ? "augmented MCL" : run.filter, run.count);
  } else {
    const PoseLattice& lattice = task.lattice();
    run.path = fmt::format("{}", fmt::join(recogniser.histogram()->paths(), "; "));
    run.count = lattice.bins();
    run.name = fmt::format("histogram {}x{}x{}", lattice.x_mm.count, lattice.y_mm.count,
                           lattice.theta_rad.count);
  }
  run.seconds = seconds_of([&] {
    for (const Recording& trial : trials) {
      if (particles != nullptr && !run.records.empty()) {
        // reset() would start from the same particles again.
        ++particles->seed;
        recogniser = Recogniser(device, task);
      }
      run.records.push_back(recognise(recogniser, task, unknown_of(trial), true));
      run.records.back().require_steps();
      run.device_bytes = std::max(run.device_bytes, recogniser.device_bytes());
    }
  });
  return run;
}

std::vector<CurvePoint> curve_of(const FilterRun& run) {
  std::vector<CurvePoint> curve;
  for (std::size_t touch = 0; touch < run.records.front().trace.size(); ++touch) {
    curve.push_back(point_of(run, touch));
  }
  return curve;
}

Calibration calibration_of(const FilterRun& run) {
  constexpr int width = 10;  // bins over [0, 1]
  std::array<Calibration::Bin, width> bins;
  int total = 0;
  for (const RecognitionRecord& record : run.records) {
    for (const RecognitionStep& step : record.trace) {
      const int i = std::min(static_cast<int>(step.confidence() * width), width - 1);
      ++bins[i].count;
      bins[i].mean_confidence += step.confidence();
      bins[i].fraction_right += *step.right ? 1.0 : 0.0;
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
