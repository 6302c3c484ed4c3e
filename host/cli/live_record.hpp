#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>

#include <nlohmann/json.hpp>

#include "recognition/live_recognition.hpp"

namespace palpate::cli {

/// One touch as JSON: time (the middle of the steady phase, seconds since the Unix
/// epoch), unknown and touch (counted from 0), pose (T_robot_sensor), the fields that `recognize`
/// writes of an estimate, latency_ms, frames_lost and, where touches were left out, left_out.
nlohmann::ordered_json to_json(const LiveTouch& touch, const RecognitionTask& task);
/// to_json() in a line.
std::string json_line(const LiveTouch& touch, const RecognitionTask& task);
/// A line of JSON for the plan that follows a touch: unknown and touch as above, and next.
std::string plan_line(const LiveTouch& touch);

/// Heading and lines of a table for people.
std::string table_heading(const RecognitionTask& task);
std::string table_line(const LiveTouch& touch, const RecognitionTask& task);

/// The whole stream in a few lines.
std::string summary(const LiveState& state, std::vector<double> latencies_ms,
                    const RecognitionTask& task);

/// Frames per second of a stream, measured over a second or more.
class FrameRate {
 public:
  /// @param frames so far
  double hz(std::uint64_t frames);

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point since_ = Clock::now();
  std::uint64_t before_ = 0;  ///< frames
  double hz_ = 0.0;
};

/// A file to which lines are added; other programs can read each line at once.
class LineFile {
 public:
  /// Replaces an older file; "-" is standard output. Throws Error.
  explicit LineFile(const std::string& path);
  /// Throws Error where the line cannot be written.
  void add(const std::string& line);

 private:
  struct Close {
    void operator()(std::FILE* file) const;
  };
  std::string path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace palpate::cli
