#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "model/own_process.hpp"
#include "palpate/pose_track.hpp"
#include "streaming/stream_lines.hpp"

namespace palpate {

namespace {

// No pose has so long a line.
constexpr std::size_t longest_line = 4096;
// read_poses() takes at most so many blocks of the lines' reader.
constexpr int blocks_at_once = 4;

using Clock = std::chrono::steady_clock;
using Kind = FrameLines::Flaw::Kind;
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

  Impl(std::unique_ptr<Sensor> inner, const std::string& name, double largest_gap_s,
       const Warn& warn)
      : sensor(std::move(inner)),
        track(largest_gap_s),
        flaws(warn ? Warn([warn](const std::string& text) { warn("poses " + text); }) : warn),
        lines("poses", name, longest_line,
              [this](const LineReader::Line& line) { take_line(line); }) {
    held_by(sensor, "sensor");  // throws where there is none
    while (lines.is_file() && read_block()) {
    }
  }

  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  // Reads the poses that have come, without waiting and at most 64 KiB, so that a flood does not
  // block the caller.
  void read_poses() {
    for (int block = 0; block < blocks_at_once && read_block(); ++block) {
    }
  }

  // Reads one block of poses; false where there is none, or none yet.
  bool read_block() {
    const bool some = lines.read_some();
    if (lines.ended() && !std::exchange(poses_ended, true)) {
      judging_order([this] { track.end(); });
    }
    return some;
  }

  void take_line(const LineReader::Line& line) {
    const auto read = line.too_long ? FrameLines::Flaw{Kind::too_long, "is longer than any pose"}
                                    : format.read(line.text, 0.0);
    if (const auto* flaw = std::get_if<FrameLines::Flaw>(&read)) {
      ++malformed;
      flaws.add(flaw->kind, words_or_throw(line.number, flaw->words));
    } else if (const auto* frame = std::get_if<Frame>(&read)) {
      const double before_s = track.last_s().value_or(frame->host_time_s);
      ++poses;
      judging_order([&] { track.add(frame->host_time_s, *frame->T_robot_sensor); });
      if (track.set_aside() == 1) {
        aside = {.line = line.number, .time_s = frame->host_time_s, .before_s = before_s};
      }
    }
  }

  // Reports what the track does with the poses that it had set aside.
  void judging_order(const auto& change_track) {
    const std::uint64_t dropped = track.dropped();
    const std::uint64_t set_back = track.set_back();
    change_track();
    const auto& [line, time_s, before_s] = aside;
    if (track.dropped() != dropped) {
      const char* when = time_s <= before_s ? "not later than" : "far later than";
      flaws.add(Kind::out_of_order,
                words_or_throw(line, fmt::format("time = {} s is {} the poses around it, at {} s",
                                                 time_s, when, before_s)));
    }
    if (track.set_back() != set_back) {  // those poses have joined the track
      flaws.say(
          Kind::clock_set_back,
          words_or_throw(line, fmt::format("time = {} s is not later than the pose before, at "
                                           "{} s, and the poses after it go on from there: the "
                                           "robot's clock was set",
                                           time_s, before_s)));
    }
  }

  // What is wrong with a line of a stream. Throws Error with these words where it stands in a file.
  std::string words_or_throw(std::uint64_t line, const std::string& words) const {
    std::string text = fmt::format(
        "{}, line {}: {}; write {{\"time\": s, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}}, "
        "or CSV with these columns",
        lines.name(), line, words);
    if (lines.is_file()) {
      throw Error(Fault::input, text);
    }
    return text;
  }

  // True where no pose that is still to come can change the frame's pose.
  bool decided(const Frame& frame) const {
    const auto last_s = track.last_s();
    return poses_ended || (last_s && *last_s >= frame.host_time_s);
  }

  // Returns the first frame once its pose is known or given up; none before.
  std::optional<Frame> release() {
    if (held.empty()) {
      return {};
    }
    const Held& first = held.front();
    if (!decided(first.frame)) {
      forget_before(first.frame.host_time_s);
      read_poses();
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
      read_poses();
    }
    if (sensor->gone() && track.last_s()) {
      forget_before(*track.last_s() - kept_while_gone_s);
    }
    return false;
  }

  // The poses of a file stay, for when the sensor starts again.
  void forget_before(double time_s) {
    if (!lines.is_file()) {
      track.forget_before(time_s);
    }
  }

  std::unique_ptr<Sensor> sensor;
  PoseTrack track;
  RefusedLines flaws;
  FrameLines format{0};
  std::uint64_t poses = 0;      // lines handed to the track
  std::uint64_t malformed = 0;  // lines that hold no pose
  bool poses_ended = false;     // no more will come
  // The first of the poses that the track has set aside.
  struct {
    std::uint64_t line = 0;
    double time_s = 0.0;
    double before_s = 0.0;  // time of the track's last pose
  } aside;
  LineReader lines;
  std::deque<Held> held;
  Poses counts;
};

PosedSensor::PosedSensor(std::unique_ptr<Sensor> sensor, const std::string& poses,
                         double largest_gap_s, Warn warn)
    : impl_(std::make_unique<Impl>(std::move(sensor), poses, largest_gap_s, warn)) {}

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
  const PoseTrack& track = impl_->track;
  counts.read = impl_->poses - track.dropped() - track.set_aside();
  counts.refused = impl_->malformed + track.dropped();
  counts.set_back = track.set_back();
  counts.first_refused = impl_->flaws.first();
  return counts;
}

}  // namespace palpate
