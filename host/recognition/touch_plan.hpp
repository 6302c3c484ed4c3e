#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/estimate.hpp"
#include "palpate/plan.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_histogram.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// What the next touch shall tell.
enum class PlanGoal { identity, pose, both };

/// The part of a gain that the goal asks for, in nats.
double gain_for(const TouchGain& gain, PlanGoal goal);

/// A smaller gain is none, to two decimals: such a touch tells nothing.
inline constexpr double least_gain_nats = 0.005;

/// A touch that may come next.
struct PlannedTouch {
  std::size_t index = 0;  ///< among the candidates
  Pose T_robot_sensor;
  TouchGain gain;
};

/// Ranks candidate touches by what each is expected to tell; see PoseHistogram::expected_gain().
/// Maps of one label count as one object. The largest gain comes first. Gains below least_gain_nats
/// count as equal; of equal gains comes first the one that tells most about object and pose
/// together, then the lower index.
/// @param elements_mm [e] living elements, in the sensor frame
std::vector<PlannedTouch> rank_touches(const PoseHistogram& histogram, const RecognitionTask& task,
                                       std::span<const Pose> T_robot_sensor,
                                       std::span<const glm::dvec2> elements_mm, PlanGoal goal,
                                       const PlanOptions& options = {});

/// Poses T_robot_sensor, some 100 to 300, of an array about the places where the object may be: its
/// centre on a square grid over the places that touch the box around the object's occupied cells in
/// a tenth of the samples or more, at four angles 45 degrees apart. Places are half the array's
/// smaller side apart, further where they would be more than 75, nearer where fewer than 25.
/// @param samples of the belief, at least one
/// @param theta_rad the first of the angles, such as that of the touch before
std::vector<Pose> candidate_grid(std::span<const PoseSample> samples, const RecognitionTask& task,
                                 std::span<const glm::dvec2> elements_mm, double theta_rad);

/// Entropy of the labels in nats, "(none)" left out.
double label_entropy(std::span<const double> identity, const RecognitionTask& task);

/// How probably a place is occupied by the object, [ny, nx], over places in the robot frame.
struct OccupancyField {
  glm::dvec2 lower_mm{0.0};  ///< corner of cell (0, 0)
  double cell_mm = 1.0;
  int nx = 0;
  int ny = 0;
  std::vector<double> probability;
};
/// The mean of the samples' maps at their poses.
/// @param cells along the longer side
OccupancyField expected_occupancy(std::span<const PoseSample> samples, const RecognitionTask& task,
                                  const glm::dvec2& lower_mm, const glm::dvec2& upper_mm,
                                  int cells);

}  // namespace palpate
