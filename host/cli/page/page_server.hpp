#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace CLI {
class App;
}

namespace palpate::cli {

inline constexpr int default_page_port = 8080;
/// Where a page is served.
struct PageAddress {
  std::string host = "127.0.0.1";
  std::optional<int> port;  ///< none: no page
};
/// Adds --page and --page-address.
void add_page_flags(CLI::App& command, PageAddress& address);

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

/// What a page may ask for besides its events.
struct PageAnswers {
  /// The JSON behind a path, such as "/map/0"; none where there is nothing.
  std::function<std::optional<std::string>(const std::string& path)> get;
  /// Does what a button asks for. Throws Error where that cannot be done.
  std::function<void(const nlohmann::json& request)> act;
};

/// What one client may take of the server. A client that takes more is hung up on.
struct RequestLimits {
  std::size_t bytes = 16384;                ///< of a request: its head and its body
  std::chrono::milliseconds reading{2000};  ///< until the whole request is there
  std::chrono::milliseconds writing{5000};  ///< that a client stops taking the answer
  int connections = 64;                     ///< that are served or wait; others are not accepted
};

/// Serves Palpate's page over HTTP from construction on: its files, the events of its feed
/// (as server-sent events, to 16 pages at a time), and `answers`. Answers are given on threads of
/// the server's own. Requests for another host than this one, or from a page of another site, get
/// 403, so that no other site reads what the robot feels.
class PageServer {
 public:
  /// @throws Error where the address is none of this machine's, or the port cannot be had
  PageServer(const PageAddress& address, PageAnswers answers, const RequestLimits& limits = {});
  /// Ends all connections, whatever their clients do.
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  PageFeed& feed();
  /// "http://127.0.0.1:8080/"
  std::string url() const;
  /// The sentence that tells where the page is, and what it exposes where others can reach it.
  std::string words() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::cli
