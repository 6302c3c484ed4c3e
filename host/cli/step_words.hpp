#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "recognition/recognition_job.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/touch_plan.hpp"

// What a step says, in the words and digits that the tables, `live` and the recognition sheet
// share.

namespace palpate::cli {

/// The numbers of a pose in the robot frame: x and y in mm, theta in degrees, two decimals each.
struct PoseText {
  std::array<std::string, 3> value;
  std::array<std::string, 3> sd;  ///< "" where there is none
};
PoseText pose_text(const Pose& T_robot_object, const std::optional<std::array<double, 3>>& sd = {});
/// T_robot_object of a step, to act on, with its standard deviations where the belief has a peak
/// there.
PoseText pose_text(const RecognitionStep& step);

/// x, y and theta for a table: "9.81+-0.05".
std::array<std::string, 3> pose_cells(const PoseText& pose);
/// "x 9.81 +-0.05 mm, y 0.23 +-0.05 mm, theta -126.04 +-0.31 deg"
std::string pose_words(const PoseText& pose);
/// The object of the step and, where the pose is another object's, that object: "A", "A mirrored",
/// "(none), pose of A".
std::string object_words(const RecognitionStep& step, const RecognitionTask& task);
/// How much of the belief lies about the pose, where this is less than 95 % of the probability of
/// the best label, or the pose is another object's.
std::optional<double> share_at_pose(const RecognitionStep& step, const RecognitionTask& task);
/// The object and its probability: "A (98.8 %)", or "unlike A (98.8 %)" where it does not fit; with
/// share_at_pose(): "A (98.8 %, 60.2 % there)", "U (42.0 %), pose of A (15.2 % there)".
std::string identity_words(const RecognitionStep& step, const RecognitionTask& task);
/// The object, its probability and its pose in the robot frame.
std::string result_words(const RecognitionStep& step, const RecognitionTask& task);
/// Modes with at least 5 % of the belief besides that of the pose.
std::vector<BeliefMode> other_modes(const RecognitionStep& step);

/// What a step says in whole sentences, for every reader in this order.
struct StepSentences {
  std::string decision;  ///< "act: " or "do not act: " and why; "" where nothing was decided
  /// The true object and its pose, as far as the step can be compared with them, and the error of
  /// the step's pose; "" where nothing is known.
  std::string truth;
  /// What is wrong, the gravest first: touches that no pose explains, bounds that prove less than
  /// was asked for, touches that do not fit, RecognitionStep::warnings, and a single touch, which
  /// cannot tell "(none)". Options are flags.
  std::vector<std::string> findings;
};
StepSentences sentences_of(const RecognitionStep& step, const RecognitionTask& task);

/// What a table says of the fit: "fits", "doubtful", "no fit" or "contradicted"; "" without a fit.
std::string fit_words(const RecognitionStep& step);

/// Dropped mass of a bounded posterior, rounded up to one digit: "3e-07"; "" without a certificate.
std::string dropped_text(const RecognitionStep& step);

/// The z of the last touch by itself, RecognitionStep::touch_fit, with its sign: "-2.3"; "" where
/// there is none.
std::string touch_fit_text(const RecognitionStep& step);

/// share_at_pose() for a table: "0.152", `else_text` where there is none.
std::string share_text(const RecognitionStep& step, const RecognitionTask& task,
                       const char* else_text = "");

/// A pose error in mm, "-" where there is none.
std::string error_text(std::optional<double> error_mm);

/// The part of a gain that the goal asks for, with its standard error: "2.31+-0.07".
std::string gain_text(const TouchGain& gain, PlanGoal goal);

/// "touch next at x 1.20 mm, y 3.40 mm, theta 45.00 deg: 2.31+-0.07 nats expected", or that even
/// this touch, the best, tells nothing.
std::string next_touch_words(const PlannedTouch& touch, PlanGoal goal);

/// Maps, bins or particles, and device in a short line.
std::string setup_words(const RecognitionJob& job);
/// Prints on standard error how the device works: its memory, the filter with its paths through the
/// likelihood, the lattice.
void print_engine(const RecognitionJob& job, const Recogniser& recogniser);

}  // namespace palpate::cli
