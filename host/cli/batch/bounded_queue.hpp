#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

namespace palpate::cli {

/// A queue between threads that holds no more than so many bytes, or one item that is larger.
template <typename Item>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Waits for room. False where the queue is closed, which drops the item.
  bool push(Item item, std::size_t bytes) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return closed_ || items_.empty() || bytes_ + bytes <= most_bytes_; });
    if (closed_) {
      return false;
    }
    bytes_ += bytes;
    items_.emplace_back(std::move(item), bytes);
    item_.notify_one();
    return true;
  }

  /// Waits for an item. None once the queue is closed and empty.
  std::optional<Item> pop() {
    std::unique_lock lock(mutex_);
    item_.wait(lock, [&] { return closed_ || !items_.empty(); });
    return take();
  }

  /// As pop(), but returns none where no item comes within this time.
  std::optional<Item> pop_within(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    item_.wait_for(lock, time, [&] { return closed_ || !items_.empty(); });
    return take();
  }

  /// Lets nothing more in. What is in the queue still comes out.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    item_.notify_all();
    room_.notify_all();
  }
  bool ended() {
    const std::lock_guard lock(mutex_);
    return closed_ && items_.empty();
  }

 private:
  std::optional<Item> take() {
    if (items_.empty()) {
      return {};
    }
    std::optional<Item> item(std::move(items_.front().first));
    bytes_ -= items_.front().second;
    items_.pop_front();
    room_.notify_all();
    return item;
  }

  std::size_t most_bytes_;
  std::mutex mutex_;
  std::condition_variable item_;
  std::condition_variable room_;
  std::deque<std::pair<Item, std::size_t>> items_;
  std::size_t bytes_ = 0;
  bool closed_ = false;
};

}  // namespace palpate::cli
