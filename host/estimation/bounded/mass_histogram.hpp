#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "log_sum.hpp"

namespace palpate {

/// Counts bins by the bounds of the tiles that they lie in, to find which tiles may be dropped
/// together.
class MassHistogram {
 public:
  /// @param largest of all bounds, in nats
  explicit MassHistogram(double largest) : largest_(largest) {}

  void add(double bound, std::int64_t bins) { bins_[slot(bound)] += bins; }
  void add(const MassHistogram& other) {
    for (std::size_t i = 0; i < slots; ++i) {
      bins_[i] += other.bins_[i];
    }
  }
  /// The tiles from this slot on hold at most this mass together.
  /// @param log_allowance in nats
  std::size_t droppable_from(double log_allowance) const {
    LogSum mass;
    std::size_t from = slots;
    while (from > 0) {
      const std::size_t i = from - 1;
      if (bins_[i] > 0) {
        // The slot's upper edge bounds its tiles.
        mass.add(largest_ - static_cast<double>(i) / per_nat +
                 std::log(static_cast<double>(bins_[i])));
      }
      if (mass.log() > log_allowance) {
        break;
      }
      from = i;
    }
    return from;
  }
  std::size_t slot(double bound) const {
    // Rounded down, so that a bound never exceeds its slot's upper edge.
    const double below = (largest_ - bound) * per_nat;
    return below >= static_cast<double>(slots - 1) ? slots - 1
                                                   : static_cast<std::size_t>(std::max(below, 0.0));
  }

 private:
  static constexpr std::size_t slots = 4096;
  static constexpr double per_nat = 8.0;

  double largest_;
  std::array<std::int64_t, slots> bins_{};
};

}  // namespace palpate
