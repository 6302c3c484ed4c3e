#include "cli/page/page_feed.hpp"

#include <algorithm>

namespace palpate::cli {

void PageFeed::put(const std::string& name, std::string data) {
  events_.push_back({++last_, name, std::make_shared<const std::string>(std::move(data))});
}

void PageFeed::set(const std::string& name, std::string data) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(events_, [&](const PageEvent& event) { return event.name == name; });
    put(name, std::move(data));
  }
  changed_.notify_all();
}

void PageFeed::add(const std::string& name, std::string data) {
  constexpr std::ptrdiff_t limit = 1000;
  {
    const std::lock_guard lock(mutex_);
    if (std::ranges::count(events_, name, &PageEvent::name) >= limit) {
      events_.erase(std::ranges::find(events_, name, &PageEvent::name));
    }
    put(name, std::move(data));
  }
  changed_.notify_all();
}

void PageFeed::forget(const std::string& name) {
  const std::lock_guard lock(mutex_);
  std::erase_if(events_, [&](const PageEvent& event) { return event.name == name; });
}

std::vector<PageEvent> PageFeed::after(std::uint64_t number,
                                       std::chrono::milliseconds timeout) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [&] { return closed_ || last_ > number; });
  const auto first = std::ranges::upper_bound(events_, number, {}, &PageEvent::number);
  return {first, events_.end()};
}

void PageFeed::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

bool PageFeed::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace palpate::cli
