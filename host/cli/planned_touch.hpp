#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "recognition/touch_plan.hpp"

namespace palpate::cli {

/// index, x_mm, y_mm, theta_rad, and the gain in nats: identity, pose, both, and the standard_error
/// of each.
nlohmann::ordered_json to_json(const PlannedTouch& touch);

/// The part of a gain that the goal asks for, with its standard error: "2.31+-0.07".
std::string gain_text(const TouchGain& gain, PlanGoal goal);

/// "touch next at x 1.20 mm, y 3.40 mm, theta 45.00 deg: 2.31+-0.07 nats expected", or that even
/// this touch, the best, tells nothing.
std::string next_touch_words(const PlannedTouch& touch, PlanGoal goal);

}  // namespace palpate::cli
