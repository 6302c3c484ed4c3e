#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "figures/chart.hpp"
#include "own_data.hpp"
#include "table.hpp"
#include "trial_errors.hpp"

namespace palpate::bench {

// The parts of the sweep over a user's own data.

/// What one lattice is worth and what it costs.
struct OwnRun {
  PoseLattice lattice;
  std::vector<RecognitionStep> steps;  ///< [unknown] after all touches
  PoseErrors errors;                   ///< where the truth is known and the object is right
  /// How far mode and refined pose lie from those of the finest run, mm, by the pose error; none
  /// where the finest run has another object.
  PoseErrors from_finest;
  Json record;  ///< for tables, charts and the document
};

/// Where more bins stop helping.
struct OwnAdvice {
  std::optional<std::size_t> mode;     ///< the first run from which on none is better; none where
  std::optional<std::size_t> refined;  ///< only the finest run would do, which none confirms
  std::string sentence;
};

/// The least number of true poses by which errors are judged.
inline constexpr std::size_t least_true_poses = 3;

/// Finds the first of the runs, by rising count, from which on none recognises more, and from which
/// on the poses lie so near to those of the finest run that the distance adds less than
/// `least_gain` to the finest run's error, as root mean squares. The error is by the truth or,
/// where fewer than `least_true_poses` are known, the standard deviation.
OwnAdvice advice_of(std::span<const OwnRun> runs, const OwnData& data);

/// Columns of the table: errors where the truth is known, else distances from the finest run.
std::vector<Column> own_columns(bool truth_known);

/// The files of the charts, without their endings, in the order of own_charts_of().
inline constexpr std::array own_chart_names{"sweep_own_bins", "sweep_own_time"};
std::vector<Chart> own_charts_of(const Json& document);

}  // namespace palpate::bench
