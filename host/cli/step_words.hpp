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

using StandardDeviations = std::optional<std::array<double, 3>>;

/// x and y in mm and theta in degrees, with their deviations, for a table: "9.81+-0.05".
std::array<std::string, 3> pose_cells(const Pose& T_robot_object,
                                      const StandardDeviations& sd = {});
/// "x 9.81 +-0.05 mm, y 0.23 +-0.05 mm, theta -126.04 +-0.31 deg"
std::string pose_words(const Pose& T_robot_object, const StandardDeviations& sd = {});
/// The deviations of a step's T_robot_object(), where the belief has a peak there.
StandardDeviations sd_at_peak(const RecognitionStep& step);

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
