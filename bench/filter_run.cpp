#include "filter_run.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "letters.hpp"

namespace palpate::bench {

namespace {

CurvePoint point_of(const FilterRun& run, std::size_t touch) {
  CurvePoint point{.touches = static_cast<int>(touch) + 1, .error = {}, .refined_error = {}};
  PoseErrors errors;
  int right = 0;
  for (const RecognitionRecord& record : run.records) {
    const RecognitionStep& step = record.trace[touch];
    right += *step.right ? 1 : 0;
    point.mean_confidence += step.confidence();
    errors.add(step);
  }
  const auto trials = static_cast<int>(run.records.size());
  point.accuracy = static_cast<double>(right) / trials;
  point.accuracy_interval = wilson_interval(right, trials);
  point.mean_confidence /= trials;
  point.error = errors_over(errors.mode_mm);
  point.refined_error = errors_over(errors.refined_mm);
  point.located = point.error ? point.error->trials : 0;
  return point;
}

std::string filter_name(const FilterOptions& filter) {
  const auto* particles = std::get_if<ParticleOptions>(&filter);
  return std::holds_alternative<HistogramOptions>(filter)  ? "histogram"
         : particles == nullptr                            ? "bounds"
         : particles->augmented                            ? "augmented"
         : particles->resampling == Resampling::systematic ? "systematic"
                                                           : "particles";
}

}  // namespace

FilterRun run_filter(Device& device, RecognitionTask task, std::span<const Unknown> unknowns,
                     bool trace) {
  FilterRun run{.filter = filter_name(task.filter), .name = {}, .records = {}};
  Recogniser recogniser(device, task);
  auto* particles = std::get_if<ParticleOptions>(&task.filter);
  if (particles != nullptr) {
    run.path = "particles";
    run.count = particles->particles;
    run.name = fmt::format("{} {}", particles->augmented ? "augmented MCL" : run.filter, run.count);
  } else {
    const PoseLattice& lattice = task.lattice();
    run.path = recogniser.path();
    run.count = lattice.bins();
    run.name = run.filter + " " + size_of(lattice);
  }
  run.seconds = seconds_of([&] {
    for (const Unknown& unknown : unknowns) {
      if (particles != nullptr && !run.records.empty()) {
        // reset() would start from the same particles again.
        ++particles->seed;
        recogniser = Recogniser(device, task);
      }
      run.records.push_back(recognise(recogniser, task, unknown, trace));
      run.records.back().require_steps();
      run.device_bytes = std::max(run.device_bytes, recogniser.device_bytes());
      run.host_bytes = std::max<std::uint64_t>(run.host_bytes, recogniser.host_bytes());
    }
  });
  return run;
}

FilterRun run_filter(Device& device, RecognitionTask task, std::span<const Recording> trials) {
  std::vector<Unknown> unknowns;
  for (const Recording& trial : trials) {
    unknowns.push_back(unknown_of(trial));
  }
  return run_filter(device, std::move(task), unknowns, true);
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

std::vector<PairedPoint> compare(const FilterRun& first, const FilterRun& second) {
  std::vector<PairedPoint> curve;
  for (std::size_t touch = 0; touch < first.records.front().trace.size(); ++touch) {
    PairedPoint point{
        .touches = static_cast<int>(touch) + 1, .error_lead_mm = {}, .error_lead_interval = {}};
    std::vector<double> leads_mm;
    for (std::size_t trial = 0; trial < first.records.size(); ++trial) {
      const RecognitionStep& a = first.records[trial].trace[touch];
      const RecognitionStep& b = second.records[trial].trace[touch];
      point.right_lead += static_cast<int>(*a.right) - static_cast<int>(*b.right);
      if (a.error_mm && b.error_mm) {
        leads_mm.push_back(*b.error_mm - *a.error_mm);
      }
    }
    point.located_by_both = static_cast<int>(leads_mm.size());
    if (!leads_mm.empty()) {
      point.error_lead_mm = mean(leads_mm);
    }
    if (leads_mm.size() > 2) {
      point.error_lead_interval = mean_interval(leads_mm);
    }
    curve.push_back(point);
  }
  return curve;
}

bool as_many(std::int64_t a, std::int64_t b) { return 10 * std::abs(a - b) <= std::max(a, b); }

std::vector<EqualCount> equal_counts(const std::vector<FilterRun>& runs) {
  std::vector<EqualCount> pairs;
  for (const FilterRun& particles : runs) {
    for (const FilterRun& histogram : runs) {
      if (particles.filter != "histogram" && particles.filter != "bounds" &&
          histogram.filter == "histogram" && as_many(histogram.count, particles.count)) {
        pairs.push_back({histogram, particles});
      }
    }
  }
  return pairs;
}

std::string ranges_of(const std::vector<int>& touches) {
  std::string text;
  for (std::size_t begin = 0; begin < touches.size();) {
    std::size_t end = begin + 1;
    while (end < touches.size() && touches[end] == touches[end - 1] + 1) {
      ++end;
    }
    text += text.empty() ? "" : ", ";
    text += end - begin == 1 ? fmt::format("{}", touches[begin])
                             : fmt::format("{}-{}", touches[begin], touches[end - 1]);
    begin = end;
  }
  return text;
}

}  // namespace palpate::bench
