#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "model/option_words.hpp"
#include "palpate/touch.hpp"
#include "recognition/evaluation.hpp"
#include "recognition/judged_results.hpp"
#include "recognition/live_recognition.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/touch_plan.hpp"

namespace palpate {

/// "fits", "doubtful" or "does not fit".
std::string verdict_text(Verdict verdict);

/// One step in the form that other programs rely on.
/// @param words of the options that its warnings name
nlohmann::ordered_json to_json(const RecognitionStep& step, const RecognitionTask& task,
                               OptionWords words = in_flags);
/// The record in the form that other programs rely on. Of an unknown that could not be recognised:
/// its name, its truth and `error`.
/// @param device that recognised it, which stands in the record beside the seconds; none leaves
/// both out, so that equal results have equal records
nlohmann::ordered_json to_json(const RecognitionRecord& record, const RecognitionTask& task,
                               const std::optional<std::string>& device, bool with_trace,
                               OptionWords words = in_flags);

// What commands other than recognize tell, in the form that other programs rely on.

/// One touch as JSON: time (the middle of the steady phase, seconds since the Unix
/// epoch), unknown and touch (counted from 0), pose (T_robot_sensor), the fields that `recognize`
/// writes of an estimate, latency_ms, frames_lost and, where touches were left out, left_out.
nlohmann::ordered_json to_json(const LiveTouch& touch, const RecognitionTask& task);
/// A line of JSON for the plan that follows a touch: unknown and touch as above, and next.
std::string plan_line(const LiveTouch& touch);

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

/// The text of a record or of an array of them. A path or a label need not be UTF-8, as JSON must.
std::string text_of(const nlohmann::ordered_json& json, int indent = -1);

}  // namespace palpate
