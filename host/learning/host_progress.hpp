#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <utility>

namespace palpate {

/// Counts parts of a work that host threads do, and tells the fraction done, one thread at a time.
class HostProgress {
 public:
  /// @param show may be empty
  HostProgress(std::size_t parts, std::function<void(double)> show)
      : parts_(parts), show_(std::move(show)) {}

  /// One part more is done. Throws what `show` throws.
  void add() {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (show_) {
      show_(static_cast<double>(done_) / static_cast<double>(parts_));
    }
  }

 private:
  std::mutex mutex_;
  std::size_t parts_;
  std::size_t done_ = 0;
  std::function<void(double)> show_;
};

/// Tells the fraction done of a work of parts that follow each other, each of a cost.
class SerialProgress {
 public:
  /// @param cost of all parts
  /// @param show may be empty; outlives this object
  SerialProgress(double cost, const std::function<void(double)>& show) : cost_(cost), show_(show) {}

  /// Shows the progress of the next part. It may outlive this object.
  std::function<void(double)> part(double cost) {
    const double begin = std::exchange(done_, done_ + cost);
    return [&show = show_, all = cost_, begin, cost](double fraction) {
      if (show) {
        show((begin + cost * fraction) / all);
      }
    };
  }

 private:
  double cost_;
  double done_ = 0.0;
  const std::function<void(double)>& show_;
};

}  // namespace palpate
