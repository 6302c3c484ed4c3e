#pragma once

#include <bitset>
#include <cstdint>
#include <string>
#include <string_view>

#include "io/descriptor.hpp"
#include "palpate/pose_track.hpp"

namespace palpate {

/// Reads lines of poses into a track as they come: see PosedSensor.
class PoseReader {
 public:
  /// @param name path of a file or FIFO, or "-": standard input
  /// @param complain called for the first refused line of each kind; may be empty
  /// @throws Error where `name` cannot be read, or a line of a file is refused
  PoseReader(const std::string& name, PoseTrack& track, PosedSensor::Complaint complain);
  PoseReader(const PoseReader&) = delete;
  PoseReader& operator=(const PoseReader&) = delete;

  /// Reads what has come, without waiting and at most 64 KiB, so that a flood does not block the
  /// caller.
  void read();
  /// True where no more poses will come.
  bool ended() const { return ended_; }
  /// True where the poses come from a file; all of them are then in the track.
  bool is_file() const { return is_file_; }
  /// Poses that joined the track.
  std::uint64_t poses() const { return poses_ - track_.dropped() - track_.set_aside(); }
  /// Lines that were refused.
  std::uint64_t refused() const { return malformed_ + track_.dropped(); }
  const std::string& first_refused() const { return first_refused_; }

 private:
  /// What may be wrong with a line.
  enum class Flaw { too_long, no_json, no_number, far_away, out_of_order, clock_set_back, kinds };

  bool read_some();
  void take(std::string_view bytes);
  void end_line();
  void add(double time_s, const Pose& T_robot_sensor);
  void judge_order(std::uint64_t dropped_before, std::uint64_t set_back_before);
  void refuse_line(Flaw flaw, std::uint64_t line, std::string_view problem);

  std::string name_;
  PoseTrack& track_;
  PosedSensor::Complaint complain_;
  Descriptor file_;      ///< none for standard input
  int descriptor_ = -1;  ///< its number
  bool is_file_ = false;
  bool is_fifo_ = false;
  bool ended_ = false;
  std::string line_;       ///< the line under way
  bool overlong_ = false;  ///< the line under way is longer than any pose
  std::uint64_t lines_ = 0;
  std::uint64_t poses_ = 0;      ///< lines handed to the track
  std::uint64_t malformed_ = 0;  ///< lines that hold no pose
  std::string first_refused_;
  std::bitset<static_cast<std::size_t>(Flaw::kinds)> told_;

  /// The first of the poses that the track has set aside.
  struct {
    std::uint64_t line = 0;
    double time_s = 0.0;
    double before_s = 0.0;  ///< time of the track's last pose
  } aside_;
};

}  // namespace palpate
