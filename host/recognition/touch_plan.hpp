#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/estimate.hpp"
#include "palpate/pose.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"

namespace palpate {

/// What the next touch shall tell.
enum class PlanGoal { identity, pose, both };
/// "identity", "pose" or "both". Throws Error naming the option.
PlanGoal parse_goal(std::string_view option, const std::string& text);
/// The goal's word.
std::string goal_word(PlanGoal goal);

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

/// The elements of the touch's array that are alive, in the sensor frame.
std::vector<glm::dvec2> living_elements(const Touch& touch);

/// Ranks candidate touches by what each is expected to tell; see PoseHistogram::expected_gain().
/// Not for particles. Maps of one label count as one object. The largest gain comes first. Gains
/// below least_gain_nats count as equal; of equal gains comes first the one that tells most about
/// object and pose together, then the lower index.
/// @param elements_mm [e] living elements, in the sensor frame
std::vector<PlannedTouch> rank_touches(const Recogniser& recogniser, const RecognitionTask& task,
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

/// What is asked of a plan.
struct PlanRequest {
  PlanGoal goal = PlanGoal::both;
  std::vector<Pose> candidates = {};  ///< T_robot_sensor; none: candidate_grid()
  PlanOptions options = {};
};
/// In the place of a file of candidates: candidate_grid().
inline constexpr const char* candidate_grid_word = "grid";
/// The request that words and numbers make.
/// @param goal see parse_goal()
/// @param candidates candidate_grid_word, a table of poses, or a recording whose touches' poses are
/// taken
/// @param tell called with what is worth saying of the table, in whole sentences
/// @throws Error on another goal, samples out of range, and a file that is missing or as
/// require_reachable()
PlanRequest plan_request(const std::string& goal, const std::string& candidates,
                         std::size_t samples, std::uint64_t seed,
                         const std::function<void(const std::string&)>& tell);
/// Requires candidates, at most a million, that a robot reaches.
/// @throws Error naming their source
void require_reachable(const std::string& source, std::span<const Pose> candidates);

/// Why particles cannot plan.
inline constexpr const char* plan_needs = "a plan needs a belief over bins";
/// @throws Error where the task has particles
void require_plannable(const RecognitionTask& task);

/// What was planned, and what is believed before the touch.
struct Plan {
  PlanGoal goal = PlanGoal::both;
  RecognitionRecord record;
  std::vector<glm::dvec2> elements_mm;  ///< living ones of the array that touches next
  std::vector<PoseSample> samples;      ///< of the belief
  double identity_nats = 0.0;           ///< entropy of the labels
  double both_nats = 0.0;               ///< entropy of objects and bins
  std::vector<PlannedTouch> ranked;     ///< see rank_touches()
  std::uint64_t seed = 0;
  double seconds = 0.0;  ///< wall time after the recognition
};
/// Recognises the unknown and ranks the touches that may come next.
/// @param recogniser of the task, without touches; see require_plannable()
/// @throws Error where the unknown has no touches or no living element, and as recognise() and
/// PoseHistogram::expected_gain() do; what `progress` throws
Plan plan_touch(Recogniser& recogniser, const RecognitionTask& task, const Query& unknown,
                const PlanRequest& request, const std::function<void(double)>& progress = {});
/// Why the gains are no more exact; "" where nothing is to be said.
std::string limit_words(const Plan& plan);

}  // namespace palpate
