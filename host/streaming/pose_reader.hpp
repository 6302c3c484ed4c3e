#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "palpate/pose_track.hpp"

namespace palpate {

/// Reads lines of poses into a track as they come: see PosedSensor.
class PoseReader {
 public:
  /// @param name path of a file or FIFO, or "-": standard input
  /// @throws Error where it cannot be read, or a line of a file is no pose
  PoseReader(const std::string& name, PoseTrack& track);
  ~PoseReader();
  PoseReader(const PoseReader&) = delete;
  PoseReader& operator=(const PoseReader&) = delete;

  /// Takes what has come, without waiting.
  void read();
  /// No more will come.
  bool ended() const { return ended_; }
  std::uint64_t poses() const { return poses_; }
  std::uint64_t refused() const { return refused_; }
  const std::string& first_refused() const { return first_refused_; }

 private:
  void take(std::string_view bytes);
  void end_line();
  void refuse_line(std::string_view problem);

  std::string name_;
  PoseTrack& track_;
  int descriptor_ = -1;
  bool is_file_ = false;
  bool is_fifo_ = false;
  bool ended_ = false;
  std::string line_;       ///< the one that has begun
  bool overlong_ = false;  ///< it has more bytes than any pose
  std::uint64_t lines_ = 0;
  std::uint64_t poses_ = 0;
  std::uint64_t refused_ = 0;
  std::string first_refused_;
};

}  // namespace palpate
