#pragma once

#include <functional>
#include <mutex>
#include <utility>

namespace palpate {

/// How much of some work is done. Its parts follow each other, each with a cost, or host threads
/// end them in any order.
class Progress {
 public:
  /// @param cost of all parts
  /// @param show told the fraction done, by one thread at a time; may be empty; outlives this
  /// object
  Progress(double cost, const std::function<void(double)>& show) : cost_(cost), show_(show) {}

  /// A part of cost 1 is done. Throws what `show` throws.
  void add() {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (show_) {
      show_(done_ / cost_);
    }
  }

  /// Shows how far the next part is. It may outlive this object.
  std::function<void(double)> part(double cost) {
    const double begin = std::exchange(done_, done_ + cost);
    return [&show = show_, all = cost_, begin, cost](double fraction) {
      if (show) {
        show((begin + cost * fraction) / all);
      }
    };
  }

 private:
  std::mutex mutex_;
  double cost_;
  double done_ = 0.0;
  const std::function<void(double)>& show_;
};

}  // namespace palpate
