#include "cli/planned_touch.hpp"

#include <fmt/format.h>

#include "cli/step_words.hpp"

namespace palpate::cli {

nlohmann::ordered_json to_json(const PlannedTouch& touch) {
  const Pose& pose = touch.T_robot_sensor;
  const TouchGain::StandardError& error = touch.gain.standard_error;
  return {{"index", touch.index},
          {"x_mm", pose.translation_mm.x},
          {"y_mm", pose.translation_mm.y},
          {"theta_rad", pose.theta_rad},
          {"gain",
           {{"identity", touch.gain.identity},
            {"pose", touch.gain.pose},
            {"both", touch.gain.both()},
            {"standard_error",
             {{"identity", error.identity}, {"pose", error.pose}, {"both", error.both}}}}}};
}

std::string gain_text(const TouchGain& gain, PlanGoal goal) {
  const TouchGain::StandardError& of = gain.standard_error;
  const double error = goal == PlanGoal::identity ? of.identity
                       : goal == PlanGoal::pose   ? of.pose
                                                  : of.both;
  return fmt::format("{:.2f}+-{:.2f}", gain_for(gain, goal), error);
}

std::string next_touch_words(const PlannedTouch& touch, PlanGoal goal) {
  if (gain_for(touch.gain, goal) < least_gain_nats) {
    return fmt::format("no candidate tells anything about the {}",
                       goal == PlanGoal::both ? "object or its pose" : goal_word(goal));
  }
  return fmt::format("touch next at {}: {} nats expected",
                     pose_words(pose_text(touch.T_robot_sensor)), gain_text(touch.gain, goal));
}

}  // namespace palpate::cli
