#include <algorithm>
#include <chrono>
#include <deque>
#include <thread>
#include <utility>

#include "palpate/pose_track.hpp"
#include "pose_reader.hpp"

namespace palpate {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

// How long a frame waits for the pose after it.
constexpr auto patience = 200ms;
// How often poses are looked for meanwhile.
constexpr auto look = 5ms;
// Frames that a replay at full speed may have waiting.
constexpr std::size_t most_held = 4096;

}  // namespace

struct PosedSensor::Impl {
  struct Held {
    Frame frame;
    Clock::time_point since;
  };

  Impl(std::unique_ptr<Sensor> inner, const std::string& name, double largest_gap_s)
      : sensor(std::move(inner)), track(largest_gap_s), reader(name, track) {}

  bool decided(const Held& waiting) const {
    const auto last_s = track.last_s();
    return reader.ended() || (last_s && *last_s >= waiting.frame.host_time_s) ||
           Clock::now() - waiting.since >= patience;
  }

  Frame release() {
    Frame frame = std::move(held.front().frame);
    held.pop_front();
    frame.T_robot_sensor = track.at(frame.host_time_s);
    ++(frame.T_robot_sensor ? counts.frames : counts.without);
    track.forget_before(frame.host_time_s);
    return frame;
  }

  std::unique_ptr<Sensor> sensor;
  PoseTrack track;
  PoseReader reader;
  std::deque<Held> held;
  Poses counts;
};

PosedSensor::PosedSensor(std::unique_ptr<Sensor> sensor, const std::string& poses,
                         double largest_gap_s)
    : impl_(std::make_unique<Impl>(std::move(sensor), poses, largest_gap_s)) {}

PosedSensor::~PosedSensor() = default;

const SensorDescription& PosedSensor::description() const { return impl_->sensor->description(); }

void PosedSensor::start() {
  impl_->held.clear();
  impl_->sensor->start();
}

std::optional<Frame> PosedSensor::next(std::chrono::milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    impl_->reader.read();
    auto& held = impl_->held;
    if (!held.empty() && impl_->decided(held.front())) {
      return impl_->release();
    }
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    if (left <= 0ms || ended()) {
      return {};
    }
    const auto wait = held.empty() ? left : std::min<std::chrono::milliseconds>(left, look);
    if (impl_->sensor->ended() || held.size() >= most_held) {
      std::this_thread::sleep_for(wait);
    } else if (std::optional<Frame> frame = impl_->sensor->next(wait)) {
      held.push_back({std::move(*frame), Clock::now()});
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
  counts.first_refused = impl_->reader.first_refused();
  return counts;
}

}  // namespace palpate
