#include "sweep_document.hpp"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

namespace palpate::bench {

namespace {

/// A field of the runs' records that holds a TrialErrors.
std::vector<TrialErrors> errors_of(const std::vector<Json>& runs, const char* field) {
  std::vector<TrialErrors> errors;
  for (const Json& run : runs) {
    TrialErrors& errors_mm = errors.emplace_back();
    for (const Json& error_mm : run.at(field)) {
      errors_mm.push_back(error_mm.is_null() ? std::nullopt : std::optional<double>(error_mm));
    }
  }
  return errors;
}

/// What more bins gain over the trials that both runs locate: to each of the runs, by rising count,
/// from the finest run of at most a fifth of its bins.
Json steps_of(const std::vector<Json>& runs, const std::vector<TrialErrors>& modes_mm,
              const std::vector<TrialErrors>& refined_mm) {
  const auto count = [&](std::size_t i) { return runs[i].at("count").get<std::int64_t>(); };
  Json steps = Json::array();
  for (std::size_t to = 0; to < runs.size(); ++to) {
    std::size_t from = to;
    while (from > 0 && 5 * count(from) > count(to)) {
      --from;
    }
    if (5 * count(from) > count(to)) {
      continue;
    }
    const auto gain = [&](const std::vector<TrialErrors>& errors_mm) {
      const PairedErrors paired = paired_errors(errors_mm[to], errors_mm[from]);
      Json errors{{"from", paired.second_mm}, {"to", paired.first_mm}};
      errors.update(difference_of(paired));
      return errors;
    };
    steps.push_back({{"cell_mm", runs[from].at("cell_mm")},
                     {"from", count(from)},
                     {"to", count(to)},
                     {"trials", paired_errors(modes_mm[from], modes_mm[to]).trials},
                     {"error_mm", gain(modes_mm)},
                     {"refined_error_mm", gain(refined_mm)}});
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

Json record_of(const ErrorStatistics& deviation) {
  return {
      {"largest", deviation.largest()}, {"rms", deviation.rms()}, {"samples", deviation.count()}};
}

Json record_of(const std::optional<ErrorsOverTrials>& errors) {
  constexpr int least_for_p95 = 20;  // of fewer trials it is the largest error
  return errors ? Json{{"trials", errors->trials},
                       {"mean", errors->mean_mm},
                       {"standard_error", errors->standard_error_mm},
                       {"median", errors->median_mm},
                       {"p95", errors->trials < least_for_p95 ? Json() : Json(errors->p95_mm)}}
                : Json(nullptr);
}

void set_errors(Json& record, const PoseErrors& errors) {
  record["trials"] = errors.mode_mm.size();
  record["error_mm"] = record_of(errors_over(errors.mode_mm));
  record["refined_error_mm"] = record_of(errors_over(errors.refined_mm));
  for (const auto& [field, errors_mm] : {std::pair("errors_mm", &errors.mode_mm),
                                         std::pair("refined_errors_mm", &errors.refined_mm)}) {
    record[field] = Json::array();
    for (const std::optional<double>& error_mm : *errors_mm) {
      record[field].push_back(error_mm ? Json(*error_mm) : Json(nullptr));
    }
  }
}

Json difference_of(const PairedErrors& paired) {
  return {{"mean", paired.first_mm - paired.second_mm},
          {"standard_error", paired.standard_error_mm}};
}

Json knee_record(const Json& points, double cell_mm, const BinCounts& balanced) {
  std::vector<Json> runs;
  std::ranges::copy_if(points, std::back_inserter(runs), [&](const Json& point) {
    return point.at("balanced") == true && point.at("cell_mm") == cell_mm;
  });
  std::ranges::sort(runs, {}, [](const Json& run) { return run.at("count").get<std::int64_t>(); });
  const std::vector<TrialErrors> modes_mm = errors_of(runs, "errors_mm");
  const std::vector<TrialErrors> refined_mm = errors_of(runs, "refined_errors_mm");
  const auto knee = [&](const std::vector<TrialErrors>& errors_mm) {
    const std::optional<std::size_t> i = knee_of(errors_mm);
    return i ? runs[*i].at("count") : Json(nullptr);
  };
  const auto bins_text = [&](const Json& bins) {
    return bins.is_null() ? "at least " + count_text(runs.back().at("count")) : count_text(bins);
  };
  const Json mode = knee(modes_mm);
  const Json refined = knee(refined_mm);
  const std::int64_t count = product(balanced);
  return {{"cell_mm", cell_mm},
          {"balanced_bins", balanced},
          {"balanced_count", count},
          {"mode_knee", mode},
          {"refined_knee", refined},
          {"floor_mm", runs.back().at("refined_error_mm")},
          {"sentence",
           fmt::format("Maps with cells of {} mm need {} bins for the mode and {} for the refined "
                       "pose; --bins fine takes {} = {}.",
                       cell_mm, bins_text(mode), bins_text(refined), plain_text(balanced),
                       bins_text(count))},
          {"steps", steps_of(runs, modes_mm, refined_mm)}};
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
      "Of {} trials with the full posterior on the same lattices, modes lie within "
      "{:.1e} mm of the windows', and refined poses within {:.1e} mm.",
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
