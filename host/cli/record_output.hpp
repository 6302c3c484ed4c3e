#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "recognition_record.hpp"

namespace palpate::cli {

/// What is evaluated, where and how, in a few words.
std::string filter_words(const Recogniser& recogniser, const RecognitionTask& task);

/// One step in the form that other programs rely on.
nlohmann::ordered_json to_json(const RecognitionStep& step, const RecognitionTask& task);
/// The record in the form that other programs rely on.
nlohmann::ordered_json to_json(const RecognitionRecord& record, const RecognitionTask& task,
                               const std::string& device, bool with_trace);

/// "A.h5", or "A.h5 frame 3".
std::string name_of(const RecognitionRecord& record);

/// The trace touch by touch, for people.
void print_trace(const RecognitionRecord& record, const RecognitionTask& task);
/// The table of all unknowns; with known truths also how many are right, the pose error and what
/// was taken for what.
void print_table(const std::vector<RecognitionRecord>& records, const RecognitionTask& task);

}  // namespace palpate::cli
