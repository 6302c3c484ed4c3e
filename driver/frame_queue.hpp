#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>

#include "palpate/sensor.hpp"

namespace palpate {

/// Passes frames from the thread that reads the bus to the thread that asks for frames. A full
/// queue drops its oldest frame and counts the loss in the next frame's lost_before.
class FrameQueue {
 public:
  /// Most frames held: 1 s of the fastest boards.
  static constexpr std::size_t capacity = 1024;

  void push(Frame frame);
  /// Takes the oldest frame, or none if none comes in time. @throws fail()'s reason when empty
  std::optional<Frame> pop(std::chrono::milliseconds timeout);
  /// Declares that no further frame will come, and why.
  void fail(std::exception_ptr reason);
  void clear();

  struct Counters {
    std::uint64_t pushed = 0;
    std::uint64_t dropped = 0;
  };
  Counters counters() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Frame> frames_;
  std::exception_ptr failure_;
  Counters counters_;
};

}  // namespace palpate
