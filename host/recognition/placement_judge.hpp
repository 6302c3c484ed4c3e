#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "palpate/pose.hpp"
#include "recognition/recogniser.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// A learned object explains touches that one pose of it does not, once touches may lie beside the
/// places that the robot says, or the object may have moved between two of them.
struct TouchPlacement {
  int object = 0;  ///< index of the hypothesis
  /// How far each touch lies from where the robot says, by itself; none where the object moved.
  DisplacementSd displaced = {};
  std::size_t moved_after = 0;  ///< last touch before that tells anything, from 1; 0: it lay still
  double moved_mm = 0.0;        ///< by how much, as pose_error_mm() has it
};

/// Judges where the touches lie before a step is believed: where "(none)" is best or the touches do
/// not fit, whether a learned object explains them all the same, at least as well as "(none)" does
/// and fit no worse than doubtfully; where the step would act or the fit is doubtful, whether its
/// object explains them far better. Touches lie up to 2 mm and the turn that belongs to it from
/// where the robot says, each by itself; or the object moved once, after two touches in contact or
/// more and before two or more. Evidence decides, tempered as that of labels, by Laplace's
/// approximation at the peaks that are found near the modes of the five most probable hypotheses.
/// Touches without a known element change nothing.
/// @param step its decision and fit are read
/// @returns none where neither helps, for particles, and where objects slip
std::optional<TouchPlacement> judge_placement(const Recogniser& recogniser,
                                              const Estimate& estimate, const RecognitionTask& task,
                                              const RecognitionStep& step);

struct PlacementWords {
  /// "the touches fit A where each lies some 1.1 mm beside the place that the robot says", or "the
  /// object seems to have moved by 1.1 mm after touch 5".
  std::string finding;
  std::string remedy;
};
PlacementWords words_of(const TouchPlacement& placement, const RecognitionTask& task);

}  // namespace palpate
