#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "palpate/error.hpp"
#include "palpate/pose_track.hpp"
#include "streaming/stream_lines.hpp"

namespace palpate {

namespace {

// No pose has so long a line.
constexpr std::size_t longest_line = 4096;
// PoseReader::read() takes at most so many blocks of the lines' reader.
constexpr int blocks_at_once = 4;

/// Reads lines of poses into a track as they come: see PosedSensor.
class PoseReader {
 public:
  /// @param name path of a file or FIFO, or "-": standard input
  /// @param warn called for the first refused line of each kind; may be empty
  /// @throws Error where `name` cannot be read, or a line of a file is refused
  PoseReader(const std::string& name, PoseTrack& track, const PosedSensor::Warn& warn)
      : track_(track),
        flaws_(warn ? PosedSensor::Warn([warn](const std::string& text) { warn("poses " + text); })
                    : warn),
        lines_("poses", name, longest_line, [this](const LineReader::Line& line) { take(line); }) {
    while (is_file() && read_some()) {
    }
  }

  PoseReader(const PoseReader&) = delete;
  PoseReader& operator=(const PoseReader&) = delete;

  /// Reads what has come, without waiting and at most 64 KiB, so that a flood does not block the
  /// caller.
  void read() {
    for (int block = 0; block < blocks_at_once && read_some(); ++block) {
    }
  }

  /// True where no more poses will come.
  bool ended() const { return ended_; }
  /// True where the poses come from a file; all of them are then in the track.
  bool is_file() const { return lines_.is_file(); }
  /// Poses that joined the track.
  std::uint64_t poses() const { return poses_ - track_.dropped() - track_.set_aside(); }
  /// Lines that were refused.
  std::uint64_t refused() const { return malformed_ + track_.dropped(); }
  const std::string& first_refused() const { return flaws_.first(); }

 private:
  using Kind = FrameLines::Flaw::Kind;

  // Reads one block; false where there is none, or none yet.
  bool read_some() {
    const bool some = lines_.read_some();
    if (lines_.ended() && !std::exchange(ended_, true)) {
      judging_order([this] { track_.end(); });
    }
    return some;
  }

  void take(const LineReader::Line& line) {
    const auto read = line.too_long ? FrameLines::Flaw{.words = "is longer than any pose"}
                                    : format_.read(line.text, 0.0);
    if (const auto* flaw = std::get_if<FrameLines::Flaw>(&read)) {
      ++malformed_;
      flaws_.add(flaw->kind, words_about(line.number, flaw->words));
    } else if (const auto* frame = std::get_if<Frame>(&read)) {
      const double before_s = track_.last_s().value_or(frame->host_time_s);
      ++poses_;
      judging_order([&] { track_.add(frame->host_time_s, *frame->T_robot_sensor); });
      if (track_.set_aside() == 1) {
        aside_ = {.line = line.number, .time_s = frame->host_time_s, .before_s = before_s};
      }
    }
  }

  // Reports what the track does with the poses that it had set aside.
  void judging_order(const auto& change_track) {
    const std::uint64_t dropped = track_.dropped();
    const std::uint64_t set_back = track_.set_back();
    change_track();
    const auto& [line, time_s, before_s] = aside_;
    if (track_.dropped() != dropped) {
      flaws_.add(
          Kind::out_of_order,
          words_about(line, fmt::format("time = {} s is {} the poses around it, at {} s", time_s,
                                        time_s <= before_s ? "not later than" : "far later than",
                                        before_s)));
    }
    if (track_.set_back() != set_back) {  // those poses have joined the track
      flaws_.say(
          Kind::clock_set_back,
          words_about(line, fmt::format("time = {} s is not later than the pose before, at {} s, "
                                        "and the poses after it go on from there: the robot's "
                                        "clock was set",
                                        time_s, before_s)));
    }
  }

  /// What is wrong with a line. @throws Error with these words where it stands in a file
  std::string words_about(std::uint64_t line, const std::string& words) const {
    const std::string text = fmt::format(
        "{}, line {}: {}; write {{\"time\": s, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}}, "
        "or CSV with these columns",
        lines_.name(), line, words);
    if (is_file()) {
      throw Error(Fault::input, text);
    }
    return text;
  }

  PoseTrack& track_;
  RefusedLines flaws_;
  FrameLines format_{0};
  LineReader lines_;
  bool ended_ = false;
  std::uint64_t poses_ = 0;      ///< lines handed to the track
  std::uint64_t malformed_ = 0;  ///< lines that hold no pose

  /// The first of the poses that the track has set aside.
  struct {
    std::uint64_t line = 0;
    double time_s = 0.0;
    double before_s = 0.0;  ///< time of the track's last pose
  } aside_;
};

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// How long a frame waits for the pose after it.
constexpr auto patience = 200ms;
// Interval between looks for poses while waiting.
constexpr auto look = 5ms;
// Most frames that wait for their poses, as in a replay at full speed.
constexpr std::size_t most_held = 4096;
// Most poses that are read ahead of the frames.
constexpr std::size_t most_poses = 1 << 16;
// When the board is gone, poses this old are kept: frames of its return are not older.
constexpr double kept_while_gone_s = 1.0;

}  // namespace

struct PosedSensor::Impl {
  struct Held {
    Frame frame;
    Clock::time_point since;
  };

  Impl(std::unique_ptr<Sensor> inner, const std::string& name, double largest_gap_s, Warn warn)
      : sensor(std::move(inner)), track(largest_gap_s), reader(name, track, std::move(warn)) {}

  // True where no pose that is still to come can change the frame's pose.
  bool decided(const Frame& frame) const {
    const auto last_s = track.last_s();
    return reader.ended() || (last_s && *last_s >= frame.host_time_s);
  }

  // Returns the first frame once its pose is known or given up; none before.
  std::optional<Frame> release() {
    if (held.empty()) {
      return {};
    }
    const Held& first = held.front();
    if (!decided(first.frame)) {
      forget_before(first.frame.host_time_s);
      reader.read();
    }
    if (!decided(first.frame) && Clock::now() - first.since < patience) {
      return {};
    }
    Frame frame = std::move(held.front().frame);
    held.pop_front();
    frame.T_robot_sensor = track.at(frame.host_time_s);
    ++(frame.T_robot_sensor ? counts.frames : counts.without);
    forget_before(frame.host_time_s);
    return frame;
  }

  // Waits for a frame and reads poses meanwhile; false where no frame came.
  bool take(std::chrono::milliseconds wait) {
    if (sensor->ended() || held.size() >= most_held) {
      std::this_thread::sleep_for(wait);
      return false;
    }
    if (std::optional<Frame> frame = sensor->next(wait)) {
      held.push_back({std::move(*frame), Clock::now()});
      return true;
    }
    if (track.size() < most_poses) {
      reader.read();
    }
    if (sensor->gone() && track.last_s()) {
      forget_before(*track.last_s() - kept_while_gone_s);
    }
    return false;
  }

  // The poses of a file stay, for when the sensor starts again.
  void forget_before(double time_s) {
    if (!reader.is_file()) {
      track.forget_before(time_s);
    }
  }

  std::unique_ptr<Sensor> sensor;
  PoseTrack track;
  PoseReader reader;
  std::deque<Held> held;
  Poses counts;
};

PosedSensor::PosedSensor(std::unique_ptr<Sensor> sensor, const std::string& poses,
                         double largest_gap_s, Warn warn)
    : impl_(std::make_unique<Impl>(std::move(sensor), poses, largest_gap_s, std::move(warn))) {}

PosedSensor::~PosedSensor() = default;

const SensorDescription& PosedSensor::description() const { return impl_->sensor->description(); }

void PosedSensor::start() {
  impl_->held.clear();
  impl_->counts = {};
  impl_->sensor->start();
}

std::optional<Frame> PosedSensor::next(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    if (std::optional<Frame> frame = impl_->release()) {
      return frame;
    }
    const auto left = std::max(
        0ms, std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()));
    if (ended()) {
      return {};
    }
    const bool taken = impl_->take(std::min<std::chrono::milliseconds>(left, look));
    if (left == 0ms) {
      return taken ? impl_->release() : std::nullopt;
    }
  }
}

bool PosedSensor::ended() const { return impl_->held.empty() && impl_->sensor->ended(); }
bool PosedSensor::gone() const { return impl_->sensor->gone(); }
void PosedSensor::stop() { impl_->sensor->stop(); }
SensorCounters PosedSensor::counters() const { return impl_->sensor->counters(); }

PosedSensor::Poses PosedSensor::poses() const {
  Poses counts = impl_->counts;
  counts.read = impl_->reader.poses();
  counts.refused = impl_->reader.refused();
  counts.set_back = impl_->track.set_back();
  counts.first_refused = impl_->reader.first_refused();
  return counts;
}

}  // namespace palpate
