#include <algorithm>
#include <chrono>
#include <deque>
#include <thread>
#include <utility>

#include "palpate/pose_track.hpp"
#include "streaming/pose_reader.hpp"

namespace palpate {

namespace {

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

  Impl(std::unique_ptr<Sensor> inner, const std::string& name, double largest_gap_s,
       Complaint complain)
      : sensor(std::move(inner)), track(largest_gap_s), reader(name, track, std::move(complain)) {}

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
                         double largest_gap_s, Complaint complain)
    : impl_(std::make_unique<Impl>(std::move(sensor), poses, largest_gap_s, std::move(complain))) {}

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
