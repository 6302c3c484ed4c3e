#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "recognition_record.hpp"

namespace palpate::cli {

/// A pose error in mm for tables, "-" where there is none.
std::string error_text(std::optional<double> error_mm);
/// The filter's size and options in a few words.
std::string filter_words(const Recogniser& recogniser, const RecognitionTask& task);

/// One step in the form that other programs rely on.
nlohmann::ordered_json to_json(const RecognitionStep& step, const RecognitionTask& task);
/// The record in the form that other programs rely on.
nlohmann::ordered_json to_json(const RecognitionRecord& record, const RecognitionTask& task,
                               const std::string& device, bool with_trace);

/// "A.h5", or "A.h5 frame 3".
std::string name_of(const RecognitionRecord& record);

/// Prints the trace, a line per touch.
void print_trace(const RecognitionRecord& record, const RecognitionTask& task);
/// Prints a line per unknown and, where truths are known, how many are right, the mean pose errors
/// and what each wrongly recognised label was taken for.
void print_table(const std::vector<RecognitionRecord>& records, const RecognitionTask& task);

}  // namespace palpate::cli
