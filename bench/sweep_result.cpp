#include "sweep_result.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "error_json.hpp"
#include "sweep_findings.hpp"

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

Json json_of(const SweepPoint& point) {
  return {
      {"filter", point.filter},
      {"cell_mm", point.cell_mm},
      {"count", point.count},
      {"bins", point.filter == "histogram" ? Json(point.bins) : Json(nullptr)},
      {"balanced", point.balanced},
      {"path", point.path},
      {"trials", point.scores.size()},
      {"seconds_per_touch", point.seconds_touch},
      {"seconds_per_unknown", point.seconds_unknown},
      {"device_bytes", point.device_bytes},
      {"accuracy", point.last.accuracy},
      {"located", point.last.located},
      {"error_mm", json_of(point.last.error)},
      {"refined_error_mm", json_of(point.last.refined_error)},
      {"nearest_bin_mm", json_of(point.nearest_bin_mm)},
      {"expected_calibration_error", point.calibration_error},
      {"deviation_nats_per_touch", point.deviation ? json_of(*point.deviation) : Json(nullptr)}};
}

std::string knee_text(const std::optional<std::int64_t>& knee) {
  return knee ? fmt::format("suffice from {} bins on", count_text(static_cast<double>(*knee)))
              : "still gain at the finest lattice";
}

double percent_less(double from, double to) { return from > 0.0 ? 100.0 * (1.0 - to / from) : 0.0; }

/// "mode 31 %, refined 4 %" of error less from one run to another.
std::string gain_text(const SweepPoint& from, const SweepPoint& to, std::size_t objects) {
  const PairedErrors mode = paired_errors(from, to, objects, false);
  const PairedErrors refined = paired_errors(from, to, objects, true);
  return fmt::format(
      "{:.3f} to {:.3f} mm by the mode ({:+.0f} %), {:.3f} to {:.3f} mm refined "
      "({:+.0f} %), {} trials",
      mode.first_mm, mode.second_mm, -percent_less(mode.first_mm, mode.second_mm), refined.first_mm,
      refined.second_mm, -percent_less(refined.first_mm, refined.second_mm), mode.trials);
}

std::string sentence_of(const CellFinding& finding, const std::vector<SweepPoint>& runs,
                        std::size_t objects) {
  std::string text = fmt::format("Cells of {} mm: modes {}, refined poses {}.", finding.cell_mm,
                                 knee_text(finding.mode_knee), knee_text(finding.refined_knee));
  // The run nearest to what auto takes, as a factor, and those next to a decade away.
  const auto distance = [&](const SweepPoint& run, double factor) {
    return std::abs(std::log(static_cast<double>(run.count) /
                             (factor * static_cast<double>(finding.balanced_count))));
  };
  const auto nearest = [&](double factor) {
    return std::min_element(runs.begin(), runs.end(), [&](const auto& a, const auto& b) {
      return distance(a, factor) < distance(b, factor);
    });
  };
  const auto balanced = nearest(1.0);
  const auto number = [](const auto& run) { return count_text(static_cast<double>(run->count)); };
  text += fmt::format(" --bins auto takes {} x {} x {} = {}", finding.balanced_bins[0],
                      finding.balanced_bins[1], finding.balanced_bins[2],
                      count_text(static_cast<double>(finding.balanced_count)));
  constexpr double close = 0.7;  // a factor of two
  if (distance(*balanced, 1.0) > close) {
    return text + ", which is beyond this sweep.";
  }
  text += ".";
  if (const auto before = nearest(0.1); before != balanced) {
    text += fmt::format(" From {} to {} bins: {}.", number(before), number(balanced),
                        gain_text(*before, *balanced, objects));
  }
  if (const auto after = nearest(10.0); after != balanced) {
    text += fmt::format(" From {} to {}: {}.", number(balanced), number(after),
                        gain_text(*balanced, *after, objects));
  }
  return text;
}

/// `count`s and what they cost, of the entries that nothing beats.
Json front_of(const std::vector<CostAndError>& entries, const std::vector<Json>& names) {
  Json front = Json::array();
  for (const std::size_t i : pareto_front(entries)) {
    Json entry = names[i];
    entry["cost"] = entries[i].cost;
    entry["error"] = entries[i].error;
    front.push_back(std::move(entry));
  }
  return front;
}

Json pose_front(const SweepResult& result) {
  std::vector<CostAndError> entries;
  std::vector<Json> names;
  for (const PosedError& posed : posed_errors(result)) {
    entries.push_back({posed.point->seconds_unknown, posed.error->mean_mm});
    names.push_back({{"filter", posed.point->filter},
                     {"pose", posed.refined ? "refined" : "mode"},
                     {"cell_mm", posed.point->cell_mm},
                     {"count", posed.point->count}});
  }
  return front_of(entries, names);
}

Json precision_front(const SweepResult& result) {
  std::vector<CostAndError> entries;
  std::vector<Json> names;
  for (const Precision& precision : result.precisions) {
    entries.push_back({precision.nanoseconds, precision.deviation.largest});
    names.push_back({{"path", precision.path}, {"count", precision.count}});
  }
  return front_of(entries, names);
}

}  // namespace

std::vector<PosedError> posed_errors(const SweepResult& result) {
  std::vector<PosedError> posed;
  for (const SweepPoint& point : result.points) {
    if (point.last.error) {
      posed.push_back({&point, false, &*point.last.error});
    }
    if (point.last.refined_error) {
      posed.push_back({&point, true, &*point.last.refined_error});
    }
  }
  return posed;
}

std::vector<SweepPoint> histograms_of(const SweepResult& result, double cell_mm) {
  std::vector<SweepPoint> runs;
  std::copy_if(result.points.begin(), result.points.end(), std::back_inserter(runs),
               [&](const SweepPoint& point) { return point.balanced && point.cell_mm == cell_mm; });
  std::stable_sort(runs.begin(), runs.end(),
                   [](const auto& a, const auto& b) { return a.count < b.count; });
  return runs;
}

CellFinding find_knee(const SweepResult& result, double cell_mm,
                      const std::array<int, 3>& balanced_bins) {
  const std::vector<SweepPoint> runs = histograms_of(result, cell_mm);
  CellFinding finding{
      .cell_mm = cell_mm,
      .balanced_bins = balanced_bins,
      .balanced_count = std::int64_t{balanced_bins[0]} * balanced_bins[1] * balanced_bins[2],
      .mode_knee = {},
      .refined_knee = {},
      .sentence = {}};
  if (const auto knee = knee_of(runs, result.objects, false)) {
    finding.mode_knee = runs[*knee].count;
  }
  if (const auto knee = knee_of(runs, result.objects, true)) {
    finding.refined_knee = runs[*knee].count;
  }
  if (runs.back().last.refined_error) {
    finding.floor_mm = runs.back().last.refined_error->mean_mm;
  }
  finding.floor_trials = runs.back().last.located;
  finding.sentence = sentence_of(finding, runs, result.objects);
  return finding;
}

Json document_of(const SweepResult& result) {
  Json document{{"touches", result.touches},   {"points", Json::array()},
                {"precisions", Json::array()}, {"fronts", Json::object()},
                {"knees", Json::array()},      {"verdicts", Json::array()}};
  for (const SweepPoint& point : result.points) {
    document["points"].push_back(json_of(point));
  }
  for (const Precision& precision : result.precisions) {
    document["precisions"].push_back({{"path", precision.path},
                                      {"count", precision.count},
                                      {"nanoseconds", precision.nanoseconds},
                                      {"deviation_nats_per_touch", json_of(precision.deviation)}});
  }
  document["fronts"] = {{"seconds per unknown, mean error in mm", pose_front(result)},
                        {"ns per pose, element and touch, largest deviation in nats per touch",
                         precision_front(result)}};
  for (const CellFinding& finding : result.findings) {
    document["knees"].push_back({{"cell_mm", finding.cell_mm},
                                 {"balanced_bins", finding.balanced_bins},
                                 {"balanced_count", finding.balanced_count},
                                 {"mode_knee", json_of(finding.mode_knee)},
                                 {"refined_knee", json_of(finding.refined_knee)},
                                 {"floor_mm", finding.floor_mm},
                                 {"floor_trials", finding.floor_trials},
                                 {"sentence", finding.sentence}});
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

std::string count_text(double count) {
  return count >= 0.9995e6   ? fmt::format("{:.3g} M", count / 1e6)
         : count >= 0.9995e3 ? fmt::format("{:.3g} k", count / 1e3)
                             : fmt::format("{:.3g}", count);
}

std::string seconds_text(double seconds) {
  return seconds >= 0.9995      ? fmt::format("{:.3g} s", seconds)
         : seconds >= 0.9995e-3 ? fmt::format("{:.3g} ms", 1e3 * seconds)
                                : fmt::format("{:.3g} us", 1e6 * seconds);
}

}  // namespace palpate::bench
