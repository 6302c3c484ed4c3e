#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "palpate/sensor.hpp"

namespace palpate {

/// A sensor whose thread reads a board between start() and stop() and passes frames to next()
/// through a queue. A full queue drops its oldest frame and counts the loss in the next frame's
/// lost_before. Meanwhile only that thread uses lose(), push() and publish(). The destructor of a
/// derived class must call stop().
class QueuedSensor : public Sensor {
 public:
  /// Most frames held: 1 s of the fastest boards.
  static constexpr std::size_t capacity = 1024;

  QueuedSensor() = default;
  QueuedSensor(const QueuedSensor&) = delete;
  QueuedSensor& operator=(const QueuedSensor&) = delete;

  const SensorDescription& description() const override { return description_; }

  std::optional<Frame> next(std::chrono::milliseconds timeout) override {
    // wait_for() adds the timeout to the clock's time: the sum must not overflow.
    constexpr std::chrono::milliseconds longest = std::chrono::hours(24 * 365);
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::clamp(timeout, std::chrono::milliseconds(0), longest),
                      [this] { return !frames_.empty() || failure_; });
    if (!frames_.empty()) {
      Frame frame = std::move(frames_.front());
      frames_.pop_front();
      return frame;
    }
    if (failure_) {
      std::rethrow_exception(failure_);
    }
    return std::nullopt;
  }

  SensorCounters counters() const override {
    const std::lock_guard lock(mutex_);
    SensorCounters counters = published_;
    counters.frames = pushed_ - dropped_;
    counters.lost += dropped_;
    return counters;
  }

 protected:
  /// Forgets the frames and the counts of an earlier stream.
  void forget() {
    const std::lock_guard lock(mutex_);
    frames_.clear();
    failure_ = nullptr;
    pushed_ = dropped_ = lost_before_next_ = 0;
    published_ = {};
  }
  /// Counts frames that are known to be lost before the next.
  void lose(std::uint64_t frames) { lost_before_next_ += frames; }
  /// Queues a frame that a deframer has made of bytes that came at this time.
  void push(Frame frame, double host_time_s) {
    frame.host_time_s = host_time_s;
    frame.lost_before = std::exchange(lost_before_next_, 0);
    {
      const std::lock_guard lock(mutex_);
      frames_.push_back(std::move(frame));
      ++pushed_;
      if (frames_.size() > capacity) {
        const std::uint64_t missing = frames_.front().lost_before + 1;
        frames_.pop_front();
        frames_.front().lost_before += missing;
        ++dropped_;
      }
    }
    changed_.notify_one();
  }
  /// Makes the counts those that counters() returns, with those of the queue.
  void publish(const SensorCounters& counters) {
    const std::lock_guard lock(mutex_);
    published_ = counters;
  }
  /// Declares that no further frame will come, and why: the exception that is handled.
  void fail() {
    {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
    changed_.notify_one();
  }

  SensorDescription description_;
  std::thread thread_;

 private:
  std::uint64_t lost_before_next_ = 0;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Frame> frames_;
  std::exception_ptr failure_;
  std::uint64_t pushed_ = 0;
  std::uint64_t dropped_ = 0;
  SensorCounters published_;
};

}  // namespace palpate
