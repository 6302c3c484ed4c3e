#include "recognition/scaled_pose.hpp"

#include <algorithm>

#include <glm/geometric.hpp>

#include "model/body_spread.hpp"

namespace palpate {

namespace {

/// The variance after all touches by readings of this variance.
double filtered(double readings_mm2, const MotionVariances& known) {
  const double of_touch = readings_mm2 + known.displacement_mm2;
  double variance = of_touch;
  for (int i = 1; i < known.touches && of_touch > 0.0; ++i) {
    const double moved = variance + known.slip_mm2;
    variance = moved * of_touch / (moved + of_touch);
  }
  return variance;
}

MotionVariances motion_variances(const RecognitionTask& task,
                                 std::span<const TouchEvidence> touches, const Body& body,
                                 const ObjectPose& pose) {
  const DisplacementSd touch_sd = task.touch_sd();
  const DisplacementSd slip_sd = task.slip_sd();
  const glm::dvec2 centroid_mm = pose.T_robot_object * body.centroid_mm;
  const auto variance_mm2 = [&](const DisplacementSd& sd, const glm::dvec2& arm_mm) {
    return 2.0 * sd.mm * sd.mm + sd.rad * sd.rad * (glm::dot(arm_mm, arm_mm) + body.inertia_mm2);
  };
  MotionVariances sum{.slip_mm2 = variance_mm2(slip_sd, {0.0, 0.0})};
  for (const TouchEvidence& touch : touches) {
    if (touch.in_contact()) {
      sum.displacement_mm2 +=
          variance_mm2(touch_sd, touch.T_robot_sensor.translation_mm - centroid_mm);
      ++sum.touches;
    }
  }
  sum.displacement_mm2 /= std::max(sum.touches, 1);
  return sum;
}

}  // namespace

double belief_factor(double factor, double variance_mm2, const MotionVariances& known) {
  if (known.displacement_mm2 == 0.0 && known.slip_mm2 == 0.0) {
    return factor;
  }
  // More readings' variance makes the belief's larger.
  double low = 0.0;
  double high = variance_mm2 * std::max(known.touches, 1);
  if (filtered(low, known) >= variance_mm2) {
    return 1.0;
  }
  constexpr int halvings = 40;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (filtered(middle, known) < variance_mm2 ? low : high) = middle;
  }
  return filtered(factor * high, known) / filtered(high, known);
}

ObjectPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                    const Body& body, const ObjectPose& pose) {
  const double sd_mm = spread_mm(body, pose);
  PoseScale scale = task.pose_scale();
  scale.factor =
      belief_factor(scale.factor, sd_mm * sd_mm, motion_variances(task, touches, body, pose));
  return scaled(body, pose, scale);
}

RefinedPose on_scale(const RecognitionTask& task, std::span<const TouchEvidence> touches,
                     const Body& body, const RefinedPose& pose) {
  const ObjectPose of_robot = on_scale(task, touches, body, inverse(pose));
  return {pose.T_object_robot,
          inverse(RefinedPose{of_robot.T_robot_object, of_robot.covariance}).covariance};
}

}  // namespace palpate
