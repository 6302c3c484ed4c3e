#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "model/option_words.hpp"
#include "palpate/setup_finding.hpp"
#include "recognition/evaluation.hpp"
#include "recognition/judged_results.hpp"
#include "recognition/touch_plan.hpp"

namespace palpate {

// What commands other than recognize tell, in the form that other programs rely on.

/// The fields of scores from `records` to `reliability`.
nlohmann::ordered_json to_json(const Scores& scores);
/// @param results that were evaluated
nlohmann::ordered_json to_json(const Evaluation& evaluation, const JudgedResults& results);

/// index, x_mm, y_mm, theta_rad, and the gain in nats: identity, pose, both, and the standard_error
/// of each.
nlohmann::ordered_json to_json(const PlannedTouch& touch);
/// @param device name of the device that computed
/// @param words of the options that its warnings name
nlohmann::ordered_json to_json(const Plan& plan, const RecognitionTask& task,
                               const std::string& device, OptionWords words = in_flags);

/// @param words of the options that its sentence names, and that mend it
nlohmann::ordered_json to_json(const SetupFinding& finding, OptionWords words = in_flags);

}  // namespace palpate
