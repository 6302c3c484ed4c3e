#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "experiment_result.hpp"

namespace palpate::bench {

namespace {

double percent(double fraction) { return 100.0 * fraction; }

/// Where the accuracy is least from some touch on.
const CurvePoint& least_accurate_from(std::span<const CurvePoint> curve, int touches) {
  const std::span<const CurvePoint> rest = curve.subspan(touches - 1);
  return *std::min_element(rest.begin(), rest.end(), [](const CurvePoint& a, const CurvePoint& b) {
    return a.accuracy < b.accuracy;
  });
}

/// Adds the number of touches from which something holds to the end, where there is one.
template <typename Holds>
void add_from(Case& result, const char* name, std::span<const CurvePoint> curve,
              const Holds& holds) {
  std::size_t touches = curve.size() + 1;
  while (touches > 1 && holds(curve[touches - 2])) {
    --touches;
  }
  if (touches <= curve.size()) {
    result.measurements.push_back({name, static_cast<double>(touches), "touches on"});
  }
}

Measurement accuracy_of(const std::string& name, const CurvePoint& point) {
  return {.name = name,
          .value = percent(point.accuracy),
          .unit = "%",
          .interval = Interval{percent(point.accuracy_interval.low),
                               percent(point.accuracy_interval.high)}};
}

}  // namespace

Case case_of(const FilterRun& run) {
  const std::vector<CurvePoint> curve = curve_of(run);
  const CurvePoint& last = curve.back();
  Case result{.name = run.name,
              .facts = {{"trials", run.records.size()},
                        {"touches", last.touches},
                        {"seconds", std::round(10.0 * run.seconds) / 10.0}},
              .measurements = {accuracy_of("accuracy at the end", last)}};
  const auto add = [&](Measurement measurement) {
    result.measurements.push_back(std::move(measurement));
  };
  add_from(result, "right in every trial from", curve,
           [](const CurvePoint& point) { return point.accuracy == 1.0; });
  const bool ten_thousand = run.filter == "histogram" && run.count == 10'000;
  const int known_after = run.filter != "histogram" ? 0
                          : ten_thousand            ? published::bins_10000_know_after
                          : run.count == 1'000      ? published::bins_1000_know_after
                                                    : 0;
  if (known_after > 0 && known_after <= last.touches) {
    Measurement least = accuracy_of(fmt::format("least accuracy from touch {} on", known_after),
                                    least_accurate_from(curve, known_after));
    least.goal = at_least(100.0);
    add(std::move(least));
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
    add_from(result, "refined poses err less than modes from", curve, [](const CurvePoint& point) {
      return point.refined_error && point.refined_error->mean_mm < point.error->mean_mm;
    });
  }
  add({"expected calibration error", percent(calibration_of(run).expected_error), "%"});
  return result;
}

namespace {

/// Which of two is ahead after how many touches. `lead` is above 0 where the first is, and none
/// where they cannot be compared.
template <typename Lead>
std::string standing(const std::vector<PairedPoint>& curve, const Lead& lead) {
  std::vector<int> ahead;
  std::vector<int> tied;
  std::vector<int> behind;
  for (const PairedPoint& point : curve) {
    if (const std::optional<double> value = lead(point)) {
      (*value > 0.0 ? ahead : *value < 0.0 ? behind : tied).push_back(point.touches);
    }
  }
  std::string text;
  for (const auto& [word, touches] :
       {std::pair("ahead", &ahead), std::pair("tied", &tied), std::pair("behind", &behind)}) {
    if (!touches->empty()) {
      text += fmt::format("{}{} at touch {}", text.empty() ? "" : "; ", word, ranges_of(*touches));
    }
  }
  return text;
}

void add_error_lead(Case& result, const std::string& name, const PairedPoint& point) {
  if (point.error_lead_mm) {
    result.measurements.push_back({.name = name,
                                   .value = *point.error_lead_mm,
                                   .unit = "mm",
                                   .interval = point.error_lead_interval});
  }
}

}  // namespace

Case comparison_of(const FilterRun& histogram, const FilterRun& particles) {
  const std::vector<PairedPoint> curve = compare(histogram, particles);
  const double trials = static_cast<double>(histogram.records.size());
  int right_lead = 0;
  double error_lead_mm = 0.0;
  int compared = 0;
  for (const PairedPoint& point : curve) {
    right_lead += point.right_lead;
    if (point.error_lead_mm) {
      error_lead_mm += *point.error_lead_mm;
      ++compared;
    }
  }
  Case result{
      .name = fmt::format("{} against {}", histogram.name, particles.name),
      .facts = {{"equal count", fmt::format("{} bins for every object; {} particles over all",
                                            histogram.count, particles.count)},
                {"identity", standing(curve, [](const PairedPoint& p) { return p.right_lead; })},
                {"pose, where both locate",
                 standing(curve, [](const PairedPoint& p) { return p.error_lead_mm; })}},
      .measurements = {
          {"accuracy ahead, mean over touches",
           percent(right_lead / trials / static_cast<double>(curve.size())), "% points"},
          {"accuracy ahead at the end", percent(curve.back().right_lead / trials), "% points"}}};
  if (compared > 0) {
    result.measurements.push_back(
        {"error less where both locate, over touches", error_lead_mm / compared, "mm"});
  }
  add_error_lead(result, "error less where both locate, at the end", curve.back());
  return result;
}

Case case_of(const PoseNoiseRuns& noisy) {
  Case result{.name = fmt::format("array off by {} mm, {} rad", noisy.noise.translation_mm,
                                  noisy.noise.rotation_rad),
              .facts = {{"trials", noisy.runs.front().records.size()},
                        {"touches", noisy.runs.front().records.front().trace.size()}}};
  for (const FilterRun& run : noisy.runs) {
    const CurvePoint last = curve_of(run).back();
    result.measurements.push_back(accuracy_of(run.name + ": accuracy at the end", last));
    if (last.error) {
      result.measurements.push_back(
          {run.name + ": mean error at the end", last.error->mean_mm, "mm"});
    }
  }
  for (const auto& [histogram, particles] : equal_counts(noisy.runs)) {
    add_error_lead(result,
                   fmt::format("{}: error less than of {}, where both locate, at the end",
                               histogram.name, particles.name),
                   compare(histogram, particles).back());
  }
  return result;
}

}  // namespace palpate::bench
