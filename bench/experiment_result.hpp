#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "filter_run.hpp"
#include "report.hpp"
#include "trials.hpp"

namespace palpate::bench {

/// What the paper reports in Sec. IV and V, of letters that it touched with a real sensor.
namespace published {

inline constexpr int bins_1000_know_after = 46;    ///< touches to an accuracy of 100 %
inline constexpr int bins_10000_know_after = 9;    ///< the same
inline constexpr double error_mm = 1.3;            ///< mean, of the histogram filter
inline constexpr double particle_accuracy = 0.74;  ///< where 10,000 particles level out

}  // namespace published

/// Filters over trials in which the array is not quite where the robot reports it.
struct PoseNoiseRuns {
  SensorPoseNoise noise;
  std::vector<FilterRun> runs;
};

struct ExperimentResult {
  std::vector<FilterRun> runs;
  std::vector<PoseNoiseRuns> pose_noise;
};

/// What a run reached beside what the paper reports of its filter.
Case case_of(const FilterRun& run);
/// A histogram against particles over the same trials, over all touches and at the end.
Case comparison_of(const FilterRun& histogram, const FilterRun& particles);
Case case_of(const PoseNoiseRuns& noisy);

/// Every curve and calibration, as `filters` and `pose_noise`.
Json document_of(const ExperimentResult& result);

/// The files that write_tables() and draw_figures() make in their folders.
std::vector<std::string> table_files();
std::vector<std::string> figure_files();

/// Writes curves.csv, calibration.csv, pose_noise.csv and trials.csv, the last with a line for
/// every touch of every trial.
/// @throws Error where the disk refuses
void write_tables(const ExperimentResult& result, const std::filesystem::path& folder);

/// Draws the document's Fig. 6a, 6b, 7a and 7b with the paper's headline numbers marked, and what
/// goes beyond the paper, each as PNG and SVG.
/// @throws Error where the disk refuses
void draw_figures(const Json& document, const std::filesystem::path& folder);

}  // namespace palpate::bench
