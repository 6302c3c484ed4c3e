#include "driver/frame_queue.hpp"

#include <algorithm>
#include <utility>

namespace palpate {

void FrameQueue::push(Frame frame) {
  {
    const std::lock_guard lock(mutex_);
    frames_.push_back(std::move(frame));
    ++counters_.pushed;
    if (frames_.size() > capacity) {
      const std::uint64_t missing = frames_.front().lost_before + 1;
      frames_.pop_front();
      frames_.front().lost_before += missing;
      ++counters_.dropped;
    }
  }
  changed_.notify_one();
}

std::optional<Frame> FrameQueue::pop(std::chrono::milliseconds timeout) {
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

void FrameQueue::fail(std::exception_ptr reason) {
  {
    const std::lock_guard lock(mutex_);
    failure_ = std::move(reason);
  }
  changed_.notify_one();
}

void FrameQueue::clear() {
  const std::lock_guard lock(mutex_);
  frames_.clear();
  failure_ = nullptr;
  counters_ = {};
}

FrameQueue::Counters FrameQueue::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

}  // namespace palpate
