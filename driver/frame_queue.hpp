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

/// Frames between the thread that reads the bus and the one that wants them. When it is full the
/// oldest goes, and the next one says how many went.
class FrameQueue {
 public:
  /// A second of the fastest boards.
  static constexpr std::size_t capacity = 1024;

  void push(Frame frame);
  /// The oldest, or none within the time. @throws what fail() was given, once no frame is left
  std::optional<Frame> pop(std::chrono::milliseconds timeout);
  /// No frame will come any more, and this is why.
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
