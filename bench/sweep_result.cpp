#include "sweep_result.hpp"

#include <algorithm>
#include <iterator>

#include "sweep_findings.hpp"
#include "sweep_words.hpp"

namespace palpate::bench {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Deviation& deviation) {
  return {{"largest", deviation.largest}, {"rms", deviation.rms}, {"samples", deviation.samples}};
}

template <typename Value>
Json json_of(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json json_of(const std::optional<ErrorsOverTrials>& errors) {
  return errors ? Json{{"trials", errors->trials},
                       {"mean", errors->mean_mm},
                       {"standard_error", errors->standard_error_mm},
                       {"median", errors->median_mm},
                       {"p95", json_of(errors->p95_mm)}}
                : Json(nullptr);
}

Json json_of(const std::optional<WindowCheck>& check) {
  return check ? Json{{"compared_trials", check->trials},
                      {"mode_difference_mm", check->mode_mm},
                      {"refined_difference_mm", check->refined_mm}}
               : Json(nullptr);
}

Json json_of(std::span<const TrialErrors> trials, PoseKind kind) {
  Json list = Json::array();
  for (const TrialErrors& trial : trials) {
    list.push_back(json_of(trial.of(kind)));
  }
  return list;
}

Json json_of(const SweepPoint& point) {
  return {{"filter", point.filter},
          {"cell_mm", point.cell_mm},
          {"count", point.count},
          {"bins", point.filter == "histogram" ? Json(point.bins) : Json(nullptr)},
          {"balanced", point.balanced},
          {"path", point.path},
          {"full_trials", point.full_trials},
          {"seconds_per_touch", point.seconds_touch},
          {"seconds_per_unknown", point.seconds_unknown},
          {"seconds_refine", json_of(point.seconds_refine)},
          {"device_bytes", point.device_bytes},
          {"accuracy", point.accuracy},
          {"least_confidence", point.least_confidence},
          {"expected_calibration_error", point.calibration_error},
          {"trials", point.errors.size()},
          {"windows", json_of(point.window)},
          {"error_mm", json_of(errors_over(point.errors, PoseKind::mode))},
          {"refined_error_mm", json_of(errors_over(point.errors, PoseKind::refined))},
          {"errors_mm", json_of(point.errors, PoseKind::mode)},
          {"refined_errors_mm", json_of(point.errors, PoseKind::refined)},
          {"nearest_bin_mm", json_of(point.nearest_bin_mm)},
          {"deviation_nats", json_of(point.deviation)}};
}

Json json_of(const CellFinding& finding) {
  return {{"cell_mm", finding.cell_mm},
          {"balanced_bins", finding.balanced_bins},
          {"balanced_count", finding.balanced_count},
          {"mode_knee", json_of(finding.mode_knee)},
          {"refined_knee", json_of(finding.refined_knee)},
          {"floor_mm", json_of(finding.floor)},
          {"sentence", finding.sentence}};
}

Json json_of(const PosedError& posed) {
  return {{"filter", posed.point->filter},
          {"pose", posed.kind == PoseKind::mode ? "mode" : "refined"},
          {"cell_mm", posed.point->cell_mm},
          {"count", posed.point->count},
          {"trials", posed.errors.trials},
          {"full_trials", posed.point->full_trials},
          {"accuracy", posed.point->accuracy},
          {"cost", posed.seconds},
          {"error", posed.errors.mean_mm},
          {"standard_error", posed.errors.standard_error_mm}};
}

Json difference_of(const SweepResult& result, const Limit& limit, PoseKind kind) {
  if (!limit.against) {
    return nullptr;
  }
  const PairedErrors paired =
      paired_errors(limit.errors, result.limits[*limit.against].errors, kind);
  return {{"mean", paired.first_mm - paired.second_mm},
          {"standard_error", paired.standard_error_mm}};
}

Json json_of(const SweepResult& result, const Limit& limit) {
  return {{"name", limit.name},
          {"count", limit.count},
          {"elements", limit.elements},
          {"error_mm", json_of(errors_over(limit.errors, PoseKind::mode))},
          {"refined_error_mm", json_of(errors_over(limit.errors, PoseKind::refined))},
          {"against", limit.against ? Json(against_text(result, limit)) : Json(nullptr)},
          {"difference_mm", difference_of(result, limit, PoseKind::mode)},
          {"refined_difference_mm", difference_of(result, limit, PoseKind::refined)}};
}

}  // namespace

std::vector<SweepPoint> histograms_of(const SweepResult& result, double cell_mm) {
  std::vector<SweepPoint> runs;
  std::copy_if(result.points.begin(), result.points.end(), std::back_inserter(runs),
               [&](const SweepPoint& point) { return point.balanced && point.cell_mm == cell_mm; });
  std::stable_sort(runs.begin(), runs.end(),
                   [](const auto& a, const auto& b) { return a.count < b.count; });
  return runs;
}

std::vector<PosedError> posed_errors(const SweepResult& result) {
  std::vector<PosedError> posed;
  for (const SweepPoint& point : result.points) {
    for (const PoseKind kind : {PoseKind::mode, PoseKind::refined}) {
      if (const auto errors = errors_over(point.errors, kind)) {
        const double refine = kind == PoseKind::refined ? *point.seconds_refine : 0.0;
        posed.push_back({&point, kind, *errors, point.seconds_unknown + refine});
      }
    }
  }
  return posed;
}

std::vector<PosedError> pose_front(const SweepResult& result) {
  std::vector<PosedError> posed = posed_errors(result);
  std::erase_if(posed, [&](const PosedError& one) {
    return one.point->accuracy < 1.0 || one.errors.trials < result.trials;
  });
  std::vector<CostAndError> entries;
  for (const PosedError& one : posed) {
    entries.push_back({one.seconds, one.errors.mean_mm});
  }
  std::vector<PosedError> front;
  for (const std::size_t i : pareto_front(entries)) {
    front.push_back(posed[i]);
  }
  return front;
}

std::vector<Precision> precision_front(const SweepResult& result) {
  std::vector<CostAndError> entries;
  for (const Precision& precision : result.precisions) {
    entries.push_back({precision.nanoseconds, precision.deviation.largest});
  }
  std::vector<Precision> front;
  for (const std::size_t i : pareto_front(entries)) {
    front.push_back(result.precisions[i]);
  }
  return front;
}

CellFinding find_knee(const SweepResult& result, double cell_mm, const BinCounts& balanced_bins) {
  const std::vector<SweepPoint> runs = histograms_of(result, cell_mm);
  std::vector<std::vector<TrialErrors>> errors;
  for (const SweepPoint& run : runs) {
    errors.push_back(run.errors);
  }
  const auto knee = [&](PoseKind kind) {
    const std::optional<std::size_t> i = knee_of(errors, kind);
    return i ? std::optional(runs[*i].count) : std::nullopt;
  };
  CellFinding finding{.cell_mm = cell_mm,
                      .balanced_bins = balanced_bins,
                      .balanced_count = product(balanced_bins),
                      .mode_knee = knee(PoseKind::mode),
                      .refined_knee = knee(PoseKind::refined),
                      .floor = errors_over(errors.back(), PoseKind::refined),
                      .sentence = {}};
  finding.sentence = knee_sentence(finding, runs);
  return finding;
}

Json document_of(const SweepResult& result) {
  Json document{{"touches", result.touches},   {"trials", result.trials},
                {"points", Json::array()},     {"windows", window_sentence(result)},
                {"precisions", Json::array()}, {"fronts", Json::object()},
                {"knees", Json::array()},      {"limits", Json::array()},
                {"verdicts", Json::array()}};
  for (const SweepPoint& point : result.points) {
    document["points"].push_back(json_of(point));
  }
  const auto json_of_precision = [](const Precision& precision) {
    return Json{{"path", precision.path},
                {"count", precision.count},
                {"nanoseconds", precision.nanoseconds},
                {"deviation_nats", json_of(precision.deviation)}};
  };
  for (const Precision& precision : result.precisions) {
    document["precisions"].push_back(json_of_precision(precision));
  }
  Json& pose = document["fronts"]["seconds per unknown, mean error in mm"] = Json::array();
  for (const PosedError& posed : pose_front(result)) {
    pose.push_back(json_of(posed));
  }
  Json& precision =
      document["fronts"]["ns per pose, element and touch, largest deviation in nats"] =
          Json::array();
  for (const Precision& one : precision_front(result)) {
    precision.push_back({{"path", one.path},
                         {"count", one.count},
                         {"cost", one.nanoseconds},
                         {"error", one.deviation.largest}});
  }
  for (const CellFinding& finding : result.findings) {
    document["knees"].push_back(json_of(finding));
  }
  for (const Limit& limit : result.limits) {
    document["limits"].push_back(json_of(result, limit));
  }
  for (const Measurement& verdict : result.verdicts) {
    document["verdicts"].push_back({{"name", verdict.name},
                                    {"value", verdict.value},
                                    {"unit", verdict.unit},
                                    {"at_most", verdict.goal->value},
                                    {"reached", verdict.reached()}});
  }
  return document;
}

}  // namespace palpate::bench
