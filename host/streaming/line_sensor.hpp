#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "palpate/pose_track.hpp"
#include "streaming/stream_lines.hpp"

namespace palpate {

/// A sensor whose frames another program writes to standard input, line by line: see FrameLines. A
/// frame without a time has the time at which it is read. A line that is refused is skipped and
/// counts as a lost frame; before the first frame it ends the stream with an error, but for 100
/// lines of words, such as a board prints as it starts, and a first line that is cut.
class LineSensor : public Sensor {
 public:
  /// @param warn called from within next() with the first refused line of each kind, and with
  /// what else is worth saying of the lines; may be empty
  /// @throws Error (Fault::input) where standard input cannot be read
  /// @param sign -1: readings fall under load, and are taken times -1
  LineSensor(SensorDescription description, PosedSensor::Warn warn, int sign = 1);

  const SensorDescription& description() const override { return description_; }
  void start() override {}
  /// @throws Error (Fault::input) where no frame comes before the first refused line, or the end
  std::optional<Frame> next(std::chrono::milliseconds timeout) override;
  bool ended() const override { return frames_.empty() && reader_.ended(); }
  void stop() override {}
  SensorCounters counters() const override { return counters_; }

  std::uint64_t refused() const { return counters_.lost; }  ///< lines
  const std::string& first_refused() const { return flaws_.first(); }

 private:
  void take(const LineReader::Line& line);
  bool may_stand_before(const LineReader::Line& line, const FrameLines::Flaw& flaw);
  std::string words_about(const LineReader::Line& line, const FrameLines::Flaw& flaw) const;
  void say_first(double now_s, double time_s);
  void refuse_line(const LineReader::Line& line, const FrameLines::Flaw& flaw);

  SensorDescription description_;
  PosedSensor::Warn warn_;
  int sign_;
  FrameLines format_;
  std::deque<Frame> frames_;  ///< read, and not yet taken
  SensorCounters counters_;
  bool has_header_ = false;        ///< no frame has come since the header
  std::uint64_t before_ = 0;       ///< lines left out before the first frame
  std::string first_before_;       ///< the first of them
  std::string flaw_before_;        ///< why it is no frame
  std::vector<double> first_s_;    ///< times of the first frames, of those that have one
  std::uint64_t lost_before_ = 0;  ///< lines refused since the last frame
  RefusedLines flaws_;
  LineReader reader_;
};

}  // namespace palpate
