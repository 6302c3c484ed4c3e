#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
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
  void set(const std::string& name, std::string data);
  /// Adds to the events of this name, of which the newest thousand are kept.
  void add(const std::string& name, std::string data);
  /// Removes the events of this name. Pages that have them keep them.
  void forget(const std::string& name);
  /// The events after this number, in order. Waits for one, for at most `timeout`; closed() returns
  /// at once.
  std::vector<PageEvent> after(std::uint64_t number, std::chrono::milliseconds timeout) const;
  /// Lets nobody wait any more.
  void close();
  bool closed() const;

 private:
  void put(const std::string& name, std::string data);

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::deque<PageEvent> events_;
  std::uint64_t last_ = 0;
  bool closed_ = false;
};

}  // namespace palpate::cli
