#pragma once

#include <bitset>
#include <cstdint>
#include <deque>
#include <string>

#include "palpate/pose_track.hpp"
#include "streaming/frame_line.hpp"
#include "streaming/line_reader.hpp"

namespace palpate {

/// A sensor whose frames another program writes to standard input, line by line: see FrameLines. A
/// frame without a time has the time at which it is read. A line that is refused is skipped and
/// counts as a lost frame; before the first frame it ends the stream with an error.
class LineSensor : public Sensor {
 public:
  /// @param complain called from within next() with the first refused line of each kind; may be
  /// empty
  /// @throws Error (Fault::input) where standard input cannot be read
  /// @param sign -1: readings fall under load, and are taken times -1
  LineSensor(SensorDescription description, PosedSensor::Complaint complain, int sign = 1);

  const SensorDescription& description() const override { return description_; }
  void start() override {}
  /// @throws Error (Fault::input) where no frame comes before the first refused line, or the end
  std::optional<Frame> next(std::chrono::milliseconds timeout) override;
  bool ended() const override { return frames_.empty() && reader_.ended(); }
  void stop() override {}
  SensorCounters counters() const override { return counters_; }

  std::uint64_t refused() const { return refused_; }  ///< lines
  const std::string& first_refused() const { return first_refused_; }

 private:
  void take(const LineReader::Line& line);
  void refuse_line(const LineReader::Line& line, FrameLines::Problem::Kind kind,
                   const std::string& problem);

  SensorDescription description_;
  PosedSensor::Complaint complain_;
  int sign_;
  FrameLines format_;
  std::deque<Frame> frames_;  ///< read, and not yet taken
  SensorCounters counters_;
  std::uint64_t lost_before_ = 0;  ///< lines refused since the last frame
  std::uint64_t refused_ = 0;
  std::string first_refused_;
  std::bitset<4> told_;  ///< kinds of refused lines
  LineReader reader_;
};

}  // namespace palpate
