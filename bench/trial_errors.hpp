#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "recognition/recognition_record.hpp"

namespace palpate::bench {

/// Pose errors of a run in mm, [trial]; none where the mode has the wrong object, and none for
/// refined poses of a filter that has no such pose.
using TrialErrors = std::vector<std::optional<double>>;

/// The errors that there are, in order.
std::vector<double> present(const TrialErrors& errors_mm);

/// Those of a run's modes and of its refined poses.
struct PoseErrors {
  TrialErrors mode_mm = {};
  TrialErrors refined_mm = {};

  /// Adds a trial, which ended with this step.
  void add(const RecognitionStep& last);
};

/// The errors that a run's trials have.
struct ErrorsOverTrials {
  int trials = 0;  ///< that have one
  double mean_mm = 0.0;
  double standard_error_mm = 0.0;  ///< of the mean; 0 for a single trial
  double median_mm = 0.0;
  double p95_mm = 0.0;  ///< of fewer than 20 trials, the largest error
};
/// None where no trial has one.
std::optional<ErrorsOverTrials> errors_over(const TrialErrors& errors_mm);

/// Least part of the mean error by which a gain counts.
inline constexpr double least_gain = 0.09;

/// Mean errors of two runs over the trials that have one in both.
struct PairedErrors {
  int trials = 0;
  double first_mm = 0.0;
  double second_mm = 0.0;
  double standard_error_mm = 0.0;  ///< of the mean difference; 0 for a single trial

  /// The second errs less by more than `least_gain` and by two standard errors; never of one trial.
  bool gain() const;
};
/// Trial i of one run is trial i of the other.
PairedErrors paired_errors(const TrialErrors& first_mm, const TrialErrors& second_mm);

/// Where more bins stop helping: the first of the runs, by rising count, that locates every trial
/// and over which no finer run has a gain(). None where only the last run would do, which no finer
/// run confirms, or where a finer run has no errors.
std::optional<std::size_t> knee_of(std::span<const TrialErrors> runs);

struct CostAndError {
  double cost = 0.0;
  double error = 0.0;
};
/// Indices of the entries on the Pareto front of cost and error, by rising cost; of equal entries,
/// the first.
std::vector<std::size_t> pareto_front(std::span<const CostAndError> entries);

}  // namespace palpate::bench
