#pragma once

#include <span>

#include "model/touch_evidence.hpp"
#include "palpate/estimate.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// What widens a belief beside its touches' readings: variances summed over the axes of the body's
/// motion, as spread_mm() sums them.
struct MotionVariances {
  double displacement_mm2 = 0.0;  ///< of a touch's array
  double slip_mm2 = 0.0;          ///< of the body between two touches
  int touches = 0;
};
/// The factor of the belief's variance where that of each touch's readings has `factor`, since what
/// displacement and slips add is known and stays: `factor` itself without these, 1 where they are
/// all that the belief's variance is made of. The belief is taken for a Kalman filter's along one
/// axis, all readings for equally good.
double belief_factor(double factor, double variance_mm2, const MotionVariances& known);

/// The pose with its covariance on the task's scale.
/// @param touches those of the belief
ObjectPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                    const Body& body, const ObjectPose& pose);
RefinedPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                     const Body& body, const RefinedPose& pose);

}  // namespace palpate
