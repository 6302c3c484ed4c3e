#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "command_run.hpp"
#include "experiment_result.hpp"

namespace palpate::bench {

namespace {

/// A summary of pose errors; null where there is none.
Json record_of(const std::optional<ErrorsOverTrials>& error) {
  return error
             ? Json{{"mean", error->mean_mm}, {"median", error->median_mm}, {"p95", error->p95_mm}}
             : Json(nullptr);
}

Json record_of(const FilterRun& run) {
  Json record{{"filter", run.filter},
              {"name", run.name},
              {"count", run.count},
              {"seconds", run.seconds},
              {"curve", Json::array()}};
  for (const CurvePoint& point : curve_of(run)) {
    record["curve"].push_back({{"touches", point.touches},
                               {"accuracy", point.accuracy},
                               {"accuracy_low", point.accuracy_interval.low},
                               {"accuracy_high", point.accuracy_interval.high},
                               {"mean_confidence", point.mean_confidence},
                               {"located", point.located},
                               {"error_mm", record_of(point.error)},
                               {"refined_error_mm", record_of(point.refined_error)}});
  }
  const Calibration calibration = calibration_of(run);
  Json bins = Json::array();
  for (const Calibration::Bin& bin : calibration.bins) {
    bins.push_back({{"lower", bin.lower},
                    {"count", bin.count},
                    {"mean_confidence", bin.mean_confidence},
                    {"fraction_right", bin.fraction_right}});
  }
  record["calibration"] = {{"expected_error", calibration.expected_error},
                           {"bins", std::move(bins)}};
  return record;
}

Json records_of(const std::vector<FilterRun>& runs) {
  Json records = Json::array();
  for (const FilterRun& run : runs) {
    records.push_back(record_of(run));
  }
  return records;
}

std::string cells(const std::optional<ErrorsOverTrials>& error) {
  return error
             ? fmt::format("{:.6g},{:.6g},{:.6g}", error->mean_mm, error->median_mm, error->p95_mm)
             : ",,";
}

std::string cell(const std::optional<double>& value) {
  return value ? fmt::format("{:.6g}", *value) : "";
}

constexpr const char* curve_head =
    "filter,count,touches,accuracy,accuracy_low,accuracy_high,mean_confidence,located,"
    "error_mean_mm,error_median_mm,error_p95_mm,refined_mean_mm,refined_median_mm,refined_p95_mm";

/// A line for every touch, each after `first`.
std::string curve_lines(const FilterRun& run, const std::string& first = "") {
  std::string lines;
  for (const CurvePoint& point : curve_of(run)) {
    lines += fmt::format("{}{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{},{},{}\n", first, run.filter,
                         run.count, point.touches, point.accuracy, point.accuracy_interval.low,
                         point.accuracy_interval.high, point.mean_confidence, point.located,
                         cells(point.error), cells(point.refined_error));
  }
  return lines;
}

std::string curves(const ExperimentResult& result) {
  std::string table = fmt::format("{}\n", curve_head);
  for (const FilterRun& run : result.runs) {
    table += curve_lines(run);
  }
  return table;
}

std::string pose_noise(const ExperimentResult& result) {
  std::string table = fmt::format("noise_mm,noise_rad,{}\n", curve_head);
  for (const PoseNoiseRuns& noisy : result.pose_noise) {
    for (const FilterRun& run : noisy.runs) {
      table += curve_lines(
          run, fmt::format("{},{},", noisy.noise.translation_mm, noisy.noise.rotation_rad));
    }
  }
  return table;
}

std::string calibration(const ExperimentResult& result) {
  std::string table = "filter,count,confidence_from,estimates,mean_confidence,fraction_right\n";
  for (const FilterRun& run : result.runs) {
    for (const Calibration::Bin& bin : calibration_of(run).bins) {
      table += fmt::format("{},{},{:.1f},{},{:.6g},{:.6g}\n", run.filter, run.count, bin.lower,
                           bin.count, bin.mean_confidence, bin.fraction_right);
    }
  }
  return table;
}

std::string trials(const ExperimentResult& result) {
  std::string table =
      "filter,count,trial,object,touches,right,confidence,error_mm,refined_error_mm\n";
  for (const FilterRun& run : result.runs) {
    for (std::size_t trial = 0; trial < run.records.size(); ++trial) {
      int touches = 0;
      for (const RecognitionStep& step : run.records[trial].trace) {
        table += fmt::format("{},{},{},{},{},{:d},{:.6g},{},{}\n", run.filter, run.count, trial,
                             run.records[trial].true_label, ++touches, *step.right,
                             step.confidence(), cell(step.error_mm), cell(step.refined_error_mm));
      }
    }
  }
  return table;
}

}  // namespace

Json document_of(const ExperimentResult& result) {
  Json document{{"filters", records_of(result.runs)}, {"pose_noise", Json::array()}};
  for (const PoseNoiseRuns& noisy : result.pose_noise) {
    document["pose_noise"].push_back({{"translation_mm", noisy.noise.translation_mm},
                                      {"rotation_rad", noisy.noise.rotation_rad},
                                      {"filters", records_of(noisy.runs)}});
  }
  return document;
}

std::vector<std::string> table_files() {
  return {"curves.csv", "calibration.csv", "pose_noise.csv", "trials.csv"};
}

void write_tables(const ExperimentResult& result, const std::filesystem::path& folder) {
  write_file(folder / "curves.csv", curves(result));
  write_file(folder / "calibration.csv", calibration(result));
  write_file(folder / "pose_noise.csv", pose_noise(result));
  write_file(folder / "trials.csv", trials(result));
}

}  // namespace palpate::bench
