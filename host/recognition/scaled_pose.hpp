#pragma once

#include <span>

#include "model/touch_evidence.hpp"
#include "palpate/estimate.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// Variances of how far each touch tells where a body is, mm^2 summed over the axes of its motion;
/// see spread_mm().
struct MotionVariances {
  double displacement_mm2 = 0.0;  ///< of a touch's array
  double slip_mm2 = 0.0;          ///< of the body between two touches
  int touches = 0;
};
/// By how much the belief's variance changes where each touch's readings are `factor` times as far
/// off. What displacement and slip add is known and stays: the factor itself where these are 0, 1
/// where they are all that the belief's variance is made of. By a Kalman filter along one axis,
/// with readings of the variance by which it ends with the belief's.
double belief_factor(double factor, double variance_mm2, const MotionVariances& known);

/// The pose with its covariance on the task's scale.
/// @param touches those of the belief
ObjectPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                    const Body& body, const ObjectPose& pose);
RefinedPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                     const Body& body, const RefinedPose& pose);

}  // namespace palpate
