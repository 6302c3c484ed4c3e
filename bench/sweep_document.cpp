#include "sweep_document.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "sweep_findings.hpp"

namespace palpate::bench {

namespace {

template <typename Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json errors_of(std::span<const TrialErrors> trials, PoseKind kind) {
  Json errors_mm = Json::array();
  for (const TrialErrors& trial : trials) {
    errors_mm.push_back(or_null(trial.of(kind)));
  }
  return errors_mm;
}

/// What more bins gain, over the trials that both runs locate.
Json step_record(const SweepPoint& from, const SweepPoint& to) {
  const auto gain = [&](PoseKind kind) {
    const PairedErrors paired = paired_errors(to.errors, from.errors, kind);
    Json errors{{"from", paired.second_mm}, {"to", paired.first_mm}};
    errors.update(difference_of(paired));
    return errors;
  };
  return {{"cell_mm", from.cell_mm},
          {"from", from.count},
          {"to", to.count},
          {"trials", paired_errors(from.errors, to.errors, PoseKind::mode).trials},
          {"error_mm", gain(PoseKind::mode)},
          {"refined_error_mm", gain(PoseKind::refined)}};
}

/// To each of the runs, by rising count, from the finest one of at most a fifth of its bins.
Json steps_of(std::span<const SweepPoint> runs) {
  Json steps = Json::array();
  for (std::size_t to = 0; to < runs.size(); ++to) {
    std::size_t from = to;
    while (from > 0 && 5 * runs[from].count > runs[to].count) {
      --from;
    }
    if (5 * runs[from].count <= runs[to].count) {
      steps.push_back(step_record(runs[from], runs[to]));
    }
  }
  return steps;
}

/// Indices of the entries on the front of two of their fields.
std::vector<std::size_t> front_of(const Json& entries, const char* cost, const char* error) {
  std::vector<CostAndError> pairs;
  for (const Json& entry : entries) {
    pairs.push_back({entry.at(Json::json_pointer(cost)), entry.at(Json::json_pointer(error))});
  }
  return pareto_front(pairs);
}

}  // namespace

Json record_of(const Deviation& deviation) {
  return {{"largest", deviation.largest}, {"rms", deviation.rms}, {"samples", deviation.samples}};
}

Json record_of(const std::optional<ErrorsOverTrials>& errors) {
  return errors ? Json{{"trials", errors->trials},
                       {"mean", errors->mean_mm},
                       {"standard_error", errors->standard_error_mm},
                       {"median", errors->median_mm},
                       {"p95", or_null(errors->p95_mm)}}
                : Json(nullptr);
}

Json difference_of(const PairedErrors& paired) {
  return {{"mean", paired.first_mm - paired.second_mm},
          {"standard_error", paired.standard_error_mm}};
}

Json record_of(const SweepPoint& point) {
  const auto& window = point.window;
  return {{"filter", point.filter},
          {"cell_mm", point.cell_mm},
          {"count", point.count},
          {"bins", point.filter == "histogram" ? Json(point.bins) : Json(nullptr)},
          {"balanced", point.balanced},
          {"path", point.path},
          {"full_trials", point.full_trials},
          {"seconds_per_touch", point.seconds_touch},
          {"seconds_per_unknown", point.seconds_unknown},
          {"seconds_refine", or_null(point.seconds_refine)},
          {"device_bytes", point.device_bytes},
          {"accuracy", point.accuracy},
          {"least_confidence", point.least_confidence},
          {"expected_calibration_error", point.calibration_error},
          {"trials", point.errors.size()},
          {"windows", window ? Json{{"compared_trials", window->trials},
                                    {"mode_difference_mm", window->mode_mm},
                                    {"refined_difference_mm", window->refined_mm}}
                             : Json(nullptr)},
          {"error_mm", record_of(errors_over(point.errors, PoseKind::mode))},
          {"refined_error_mm", record_of(errors_over(point.errors, PoseKind::refined))},
          {"errors_mm", errors_of(point.errors, PoseKind::mode)},
          {"refined_errors_mm", errors_of(point.errors, PoseKind::refined)},
          {"nearest_bin_mm", or_null(point.nearest_bin_mm)},
          {"deviation_nats", record_of(point.deviation)}};
}

Json knee_record(std::span<const SweepPoint> points, double cell_mm, const BinCounts& balanced) {
  std::vector<SweepPoint> runs;
  std::copy_if(points.begin(), points.end(), std::back_inserter(runs),
               [&](const SweepPoint& point) { return point.balanced && point.cell_mm == cell_mm; });
  std::ranges::sort(runs, std::less(), &SweepPoint::count);
  std::vector<std::vector<TrialErrors>> errors;
  for (const SweepPoint& run : runs) {
    errors.push_back(run.errors);
  }
  const auto knee = [&](PoseKind kind) {
    const std::optional<std::size_t> i = knee_of(errors, kind);
    return i ? std::optional(runs[*i].count) : std::nullopt;
  };
  const auto bins_text = [&](const std::optional<std::int64_t>& bins) {
    return (bins ? "" : "at least ") +
           count_text(static_cast<double>(bins.value_or(runs.back().count)));
  };
  const std::optional<std::int64_t> mode = knee(PoseKind::mode);
  const std::optional<std::int64_t> refined = knee(PoseKind::refined);
  const std::int64_t count = product(balanced);
  return {{"cell_mm", cell_mm},
          {"balanced_bins", balanced},
          {"balanced_count", count},
          {"mode_knee", or_null(mode)},
          {"refined_knee", or_null(refined)},
          {"floor_mm", record_of(errors_over(errors.back(), PoseKind::refined))},
          {"sentence",
           fmt::format("Maps with cells of {} mm need {} bins for the mode and {} for the refined "
                       "pose; --bins auto takes {} = {}.",
                       cell_mm, bins_text(mode), bins_text(refined), plain_text(balanced),
                       bins_text(count))},
          {"steps", steps_of(runs)}};
}

std::string window_sentence(const Json& points) {
  int trials = 0;
  double mode_mm = 0.0;
  double refined_mm = 0.0;
  for (const Json& point : points) {
    if (const Json& windows = point.at("windows"); !windows.is_null()) {
      trials += windows.at("compared_trials").get<int>();
      mode_mm = std::max<double>(mode_mm, windows.at("mode_difference_mm"));
      refined_mm = std::max<double>(refined_mm, windows.at("refined_difference_mm"));
    }
  }
  return fmt::format(
      "Of {} trials with the full posterior on the same lattices, modes lie within {:.1e} mm of "
      "the windows', and refined poses within {:.1e} mm.",
      trials, mode_mm, refined_mm);
}

std::vector<PosedError> posed_errors(const Json& points) {
  std::vector<PosedError> posed;
  for (const Json& point : points) {
    const double seconds = point.at("seconds_per_unknown");
    if (const Json& error_mm = point.at("error_mm"); !error_mm.is_null()) {
      posed.push_back({point, "mode", error_mm, seconds});
    }
    if (const Json& error_mm = point.at("refined_error_mm"); !error_mm.is_null()) {
      posed.push_back(
          {point, "refined", error_mm, seconds + point.at("seconds_refine").get<double>()});
    }
  }
  return posed;
}

Json fronts_of(const Json& points, const Json& precisions, int trials) {
  Json poses = Json::array();
  for (const PosedError& posed : posed_errors(points)) {
    if (posed.point.at("accuracy") == 1.0 && posed.error_mm.at("trials") == trials) {
      poses.push_back({{"filter", posed.point.at("filter")},
                       {"pose", posed.pose},
                       {"cell_mm", posed.point.at("cell_mm")},
                       {"count", posed.point.at("count")},
                       {"trials", trials},
                       {"full_trials", posed.point.at("full_trials")},
                       {"accuracy", posed.point.at("accuracy")},
                       {"cost", posed.seconds},
                       {"error", posed.error_mm.at("mean")},
                       {"standard_error", posed.error_mm.at("standard_error")}});
    }
  }
  Json fronts{{pose_front, Json::array()}, {precision_front, Json::array()}};
  for (const std::size_t i : front_of(poses, "/cost", "/error")) {
    fronts[pose_front].push_back(poses[i]);
  }
  for (const std::size_t i : front_of(precisions, "/nanoseconds", "/deviation_nats/largest")) {
    fronts[precision_front].push_back(
        {{"path", precisions[i].at("path")},
         {"count", precisions[i].at("count")},
         {"cost", precisions[i].at("nanoseconds")},
         {"error", precisions[i].at("deviation_nats").at("largest")}});
  }
  return fronts;
}

}  // namespace palpate::bench
