#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "filter_run.hpp"
#include "none_run.hpp"

namespace palpate::bench {

struct ExperimentResult {
  std::vector<std::string> true_objects;  ///< [trial]
  std::vector<FilterRun> runs;
  std::vector<NoneRun> none;
};

/// Weights of "none of these" at which its curves are sampled, as log10.
std::vector<double> sampled_log10_weights(const std::vector<NoneRun>& runs);

/// Every curve, calibration and "none" table, as `filters` and `none`.
nlohmann::ordered_json document_of(const ExperimentResult& result);

/// Writes curves.csv, calibration.csv, none.csv and trials.csv, the last with a line for every
/// touch of every trial.
/// @throws Error where the disk refuses
void write_tables(const ExperimentResult& result, const std::filesystem::path& folder);

/// Draws the paper's Fig. 6a, 6b, 7a and 7b with its headline numbers marked, and what goes beyond
/// it, each as PNG and SVG.
/// @throws Error where gnuplot or the disk refuses
void draw_figures(const ExperimentResult& result, const std::filesystem::path& folder);

}  // namespace palpate::bench
