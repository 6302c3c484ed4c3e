#pragma once

#include <string>
#include <vector>

#include "recognition/live_recognition.hpp"
#include "recognition/recognition_record.hpp"

namespace palpate::cli {

// What people read of records, and of each touch of a stream.

/// Dropped mass of a bounded posterior, rounded up to one digit: "3e-07"; "" without a certificate.
std::string dropped_text(const RecognitionStep& step);

/// "A.h5", or "A.h5 frame 3".
std::string name_of(const RecognitionRecord& record);

/// The trace, a line per touch, then the truth as far as it is known.
std::string trace_table(const RecognitionRecord& record, const RecognitionTask& task);

/// A line for each of StepSentences::findings, after the names of the unknowns that it is of.
std::string findings(const std::vector<RecognitionRecord>& records, const RecognitionTask& task);

/// First whether to act on each of up to three unknowns and why, or on how many of more. Then for
/// each unknown a line with its pose in the robot frame, below it a line for each other mode with
/// at least 5 % of the belief, one with the mode where the pose is between the bins, and a line
/// with the truth where it is known. Then what is wrong with which unknown and, where truths are
/// known, how many are right and the mean pose errors.
std::string result_table(const std::vector<RecognitionRecord>& records,
                         const RecognitionTask& task);

// A table for people, whose lines are printed as touches come.
std::string live_heading(const RecognitionTask& task);
std::string live_line(const LiveTouch& touch, const RecognitionTask& task);

/// The whole stream in a few lines.
std::string summary(const LiveState& state, std::vector<double> latencies_ms,
                    const RecognitionTask& task);

}  // namespace palpate::cli
