#pragma once

#include <optional>
#include <span>

#include "recognition_record.hpp"

namespace palpate::bench {

/// Which pose of an estimate: the best bin, or the one between the bins.
enum class PoseKind { mode, refined };

/// Pose errors of one trial after its last touch, where the mode has the right object.
struct TrialErrors {
  std::optional<double> mode_mm = {};
  std::optional<double> refined_mm = {};  ///< none for filters without a refined pose, too

  const std::optional<double>& of(PoseKind kind) const {
    return kind == PoseKind::mode ? mode_mm : refined_mm;
  }
};

/// The errors of a trial's last step.
TrialErrors errors_of(const RecognitionStep& last);

/// The errors that a run's trials have.
struct ErrorsOverTrials {
  int trials = 0;  ///< that have one
  double mean_mm = 0.0;
  double standard_error_mm = 0.0;  ///< of the mean; 0 for a single trial
  double median_mm = 0.0;
  std::optional<double> p95_mm = {};  ///< none of fewer than 20, where it is the largest
};
/// None where no trial has one.
std::optional<ErrorsOverTrials> errors_over(std::span<const TrialErrors> trials, PoseKind kind);

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
PairedErrors paired_errors(std::span<const TrialErrors> first, std::span<const TrialErrors> second,
                           PoseKind kind);

}  // namespace palpate::bench
