#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "recognition/live_recognition.hpp"

namespace palpate::cli {

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
