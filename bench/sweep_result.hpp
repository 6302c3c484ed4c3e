#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "chart.hpp"
#include "report.hpp"
#include "sweep_limits.hpp"
#include "sweep_paths.hpp"
#include "sweep_plan.hpp"
#include "sweep_point.hpp"

namespace palpate::bench {

/// Where more bins stop helping on maps of one cell size, as the data say.
struct CellFinding {
  double cell_mm = 0.0;
  BinCounts balanced_bins{};  ///< what --bins auto takes
  std::int64_t balanced_count = 0;
  std::optional<std::int64_t> mode_knee;     ///< bins per object, see knee_of()
  std::optional<std::int64_t> refined_knee;  ///< the same for the refined pose
  std::optional<ErrorsOverTrials> floor;     ///< of the refined pose on the finest lattice
  std::string sentence;                      ///< the finding in words
};

struct SweepResult {
  int trials = 0;  ///< over which errors are compared
  int touches = 0;
  std::vector<SweepPoint> points;
  std::vector<Precision> precisions;
  std::vector<CellFinding> findings;  ///< by falling cell size
  std::vector<Limit> limits;
  std::vector<Measurement> verdicts;
};

/// The runs of the histogram on balanced lattices and maps of one cell size, by rising count.
std::vector<SweepPoint> histograms_of(const SweepResult& result, double cell_mm);

/// The errors of a run's modes or of its refined poses, and what they cost.
struct PosedError {
  const SweepPoint* point = nullptr;
  PoseKind kind = PoseKind::mode;
  ErrorsOverTrials errors;
  double seconds = 0.0;  ///< per unknown with an estimate after each touch and, where refined, one
                         ///< refined pose
};
/// All there are, in the order of the runs; they point into the result.
std::vector<PosedError> posed_errors(const SweepResult& result);
/// Those that none beats in time and mean error, of runs that recognise and locate all trials:
/// errors over some of the trials would flatter.
std::vector<PosedError> pose_front(const SweepResult& result);

/// Those that none beats in time and largest deviation.
std::vector<Precision> precision_front(const SweepResult& result);

/// What the lattice that --bins auto takes for maps of one cell size has to do with its runs.
CellFinding find_knee(const SweepResult& result, double cell_mm, const BinCounts& balanced_bins);

/// Points, precisions, findings, limits, verdicts and fronts.
nlohmann::ordered_json document_of(const SweepResult& result);

/// A result as one self-contained page, with the facts at its head.
std::string page_of(const SweepResult& result, const nlohmann::ordered_json& facts);

/// The page's charts.
struct NamedChart {
  std::string name;
  std::string title;
  Chart chart;
  std::string caption;  ///< for people who read the chart
};
inline constexpr std::array chart_names{"front", "precision", "bins"};
std::vector<NamedChart> charts_of(const SweepResult& result);

}  // namespace palpate::bench
