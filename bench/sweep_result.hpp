#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "report.hpp"
#include "sweep_point.hpp"

namespace palpate::bench {

/// Where more bins stop helping on maps of one cell size, as the data say.
struct CellFinding {
  double cell_mm = 0.0;
  std::array<int, 3> balanced_bins{};  ///< what --bins auto takes
  std::int64_t balanced_count = 0;
  std::optional<std::int64_t> mode_knee;     ///< bins per object, see knee_of()
  std::optional<std::int64_t> refined_knee;  ///< the same for the refined pose
  double floor_mm = 0.0;  ///< mean error of the refined pose on the finest lattice
  int floor_trials = 0;
  std::string sentence;  ///< the finding in words
};

struct SweepResult {
  std::size_t objects = 0;
  int touches = 0;
  std::vector<SweepPoint> points;
  std::vector<Precision> precisions;
  std::vector<CellFinding> findings;  ///< by falling cell size
  std::vector<Measurement> verdicts;
};

/// The runs of the histogram on balanced lattices and maps of one cell size, by rising count.
std::vector<SweepPoint> histograms_of(const SweepResult& result, double cell_mm);

/// The mean error of a run's modes or of its refined poses.
struct PosedError {
  const SweepPoint* point = nullptr;
  bool refined = false;
  const ErrorSummary* error = nullptr;
};
/// All there are, in the order of the runs; they point into the result.
std::vector<PosedError> posed_errors(const SweepResult& result);

/// What the lattice that --bins auto takes for maps of one cell size has to do with its runs.
CellFinding find_knee(const SweepResult& result, double cell_mm,
                      const std::array<int, 3>& balanced_bins);

/// Points, precisions, findings, verdicts and fronts.
nlohmann::ordered_json document_of(const SweepResult& result);

/// A result as one self-contained page, with the facts at its head.
std::string page_of(const SweepResult& result, const nlohmann::ordered_json& facts);

/// The page's charts.
struct NamedChart {
  std::string name;
  std::string title;
  std::string svg;      ///< for a page that has chart_style()
  std::string file;     ///< by itself
  std::string caption;  ///< for people who read the chart
};
std::vector<NamedChart> charts_of(const SweepResult& result);

/// A count such as 100, 17.5 k or 1 M.
std::string count_text(double count);
/// Seconds with a unit and a prefix.
std::string seconds_text(double seconds);

}  // namespace palpate::bench
