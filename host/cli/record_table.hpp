#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

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
/// known, how many are right, the mean pose errors and what each wrongly recognised label was taken
/// for.
std::string result_table(const std::vector<RecognitionRecord>& records,
                         const RecognitionTask& task);

/// One touch as JSON: time (the middle of the steady phase, seconds since the Unix
/// epoch), unknown and touch (counted from 0), pose (T_robot_sensor), the fields that `recognize`
/// writes of an estimate, latency_ms, frames_lost and, where touches were left out, left_out.
nlohmann::ordered_json to_json(const LiveTouch& touch, const RecognitionTask& task);
/// A line of JSON for the plan that follows a touch: unknown and touch as above, and next.
std::string plan_line(const LiveTouch& touch);

/// Heading and lines of a table for people, whose lines are printed as touches come.
std::string table_heading(const RecognitionTask& task);
std::string table_line(const LiveTouch& touch, const RecognitionTask& task);

/// The whole stream in a few lines.
std::string summary(const LiveState& state, std::vector<double> latencies_ms,
                    const RecognitionTask& task);

}  // namespace palpate::cli
