#pragma once

#include <optional>
#include <string>
#include <vector>

#include "recognition_record.hpp"

namespace palpate::cli {

/// "A.h5", or "A.h5 frame 3".
std::string name_of(const RecognitionRecord& record);

/// The trace, a line per touch, then the truth as far as it is known.
/// @param columns see TextTable::text()
std::string trace_table(const RecognitionRecord& record, const RecognitionTask& task,
                        std::optional<int> columns);

/// A line per unknown, with its pose in the robot frame and, where the true pose is known, a line
/// with the truth below it. Then what is wrong with which unknown and, where truths are known, how
/// many are right, the mean pose errors and what each wrongly recognised label was taken for.
/// @param with_modes whether a line below each unknown shows the mode
/// @param columns see TextTable::text()
std::string result_table(const std::vector<RecognitionRecord>& records, const RecognitionTask& task,
                         bool with_modes, std::optional<int> columns);

}  // namespace palpate::cli
