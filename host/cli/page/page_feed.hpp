#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace palpate::cli {

/// An event for the pages that look: a name, and a line of JSON with its end.
struct PageEvent {
  std::uint64_t number = 0;  ///< grows from event to event
  std::string name;
  std::shared_ptr<const std::string> data;
};

/// What a page shows, as events. Whoever begins to look gets all that are kept; whoever is slow
/// misses those that were replaced meanwhile, and holds up nobody.
class PageFeed {
 public:
  /// Replaces the events of this name.
  void set(const std::string& name, std::string data) {
    forget(name);
    add(name, std::move(data));
  }
  /// Adds to the events of this name, of which the newest thousand are kept.
  void add(const std::string& name, std::string data) {
    constexpr std::ptrdiff_t limit = 1000;
    const std::lock_guard lock(mutex_);
    if (std::ranges::count(events_, name, &PageEvent::name) >= limit) {
      events_.erase(std::ranges::find(events_, name, &PageEvent::name));
    }
    events_.push_back({++last_, name, std::make_shared<const std::string>(std::move(data))});
    changed_.notify_all();
  }
  /// Removes the events of this name. Pages that have them keep them.
  void forget(const std::string& name) {
    const std::lock_guard lock(mutex_);
    std::erase_if(events_, [&](const PageEvent& event) { return event.name == name; });
  }
  /// The events after this number, in order. Waits for one, for at most `timeout`; closed() returns
  /// at once.
  std::vector<PageEvent> after(std::uint64_t number, std::chrono::milliseconds timeout) const {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return closed_ || last_ > number; });
    const auto first = std::ranges::upper_bound(events_, number, {}, &PageEvent::number);
    return {first, events_.end()};
  }
  /// Lets nobody wait any more.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  bool closed() const {
    const std::lock_guard lock(mutex_);
    return closed_;
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::deque<PageEvent> events_;
  std::uint64_t last_ = 0;
  bool closed_ = false;
};

}  // namespace palpate::cli
