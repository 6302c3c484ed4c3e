#pragma once

#include <cstdio>
#include <memory>
#include <string>

#include "live_recognition.hpp"

namespace palpate::cli {

/// One touch in the form that other programs rely on, a line of JSON: time (of the middle of the
/// steady phase, in seconds since the Unix epoch), unknown and touch from 0 on, pose
/// (T_robot_sensor), what `recognize` writes of an estimate, latency_ms, frames_lost.
std::string json_line(const LiveTouch& touch, const RecognitionTask& task);

/// Heading and lines of a table for people.
std::string table_heading();
std::string table_line(const LiveTouch& touch, const RecognitionTask& task);

/// What became of it all, in a few lines.
std::string summary(const LiveState& state, std::vector<double> latencies_ms,
                    const RecognitionTask& task);

/// A file that lines are added to, each there for others to read at once.
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
