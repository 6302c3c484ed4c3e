#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "estimation/bounded/tables/tile_bounds.hpp"

namespace palpate {

/// A sum of many e^-penalty, from below a least one: each rounded up to whole sixteenths of a nat,
/// and what lies 64 nats below the least to e^-64 of it.
class PenaltySum {
 public:
  explicit PenaltySum(std::int64_t least) : least_(least) {}

  void add(std::int64_t penalty, std::int64_t times) {
    const auto slot =
        static_cast<std::size_t>(std::max<std::int64_t>(penalty - least_, 0) / per_slot);
    sum_ += static_cast<double>(times) * shares()[std::min(slot, slots - 1)];
  }
  /// Log of the sum, in nats.
  double log() const { return std::log(sum_) - static_cast<double>(least_) / penalties_per_nat; }

 private:
  static constexpr std::int64_t per_slot = 16;
  static constexpr std::size_t slots = 1025;

  static const std::array<double, slots>& shares() {
    static const auto all = [] {
      std::array<double, slots> of{};
      for (std::size_t i = 0; i < slots; ++i) {
        of[i] = std::exp(-static_cast<double>(per_slot * i) / penalties_per_nat);
      }
      return of;
    }();
    return all;
  }

  std::int64_t least_;
  double sum_ = 0.0;
};

}  // namespace palpate
