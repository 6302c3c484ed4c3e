#pragma once

#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "model/option_words.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate {

/// "fits", "doubtful" or "does not fit".
std::string verdict_text(Verdict verdict);

/// The truth as it was given: the object and, where it is known, T_robot_object [x, y, theta].
nlohmann::ordered_json truth_to_json(const PartialTruth& truth);
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
/// The text of a record or of an array of them. A path or a label need not be UTF-8, as JSON must.
std::string text_of(const nlohmann::ordered_json& json, int indent = -1);

}  // namespace palpate
