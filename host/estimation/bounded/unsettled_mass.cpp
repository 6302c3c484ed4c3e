#include "unsettled_mass.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace palpate {

std::size_t UnsettledMass::slot(double bound) const {
  // Rounded down, so that a bound never exceeds its slot's upper edge.
  const double below = (largest_ - bound) / slot_nats_;
  return below >= static_cast<double>(slots - 1) ? slots - 1
                                                 : static_cast<std::size_t>(std::max(below, 0.0));
}

double UnsettledMass::upper_edge(std::size_t slot) const {
  return largest_ - static_cast<double>(slot) * slot_nats_;
}

std::size_t UnsettledMass::droppable_from(const std::int64_t* bins, double log_allowance) const {
  // The log of any number of bins is less.
  constexpr double most_log_bins = 44.0;
  const double decay = std::exp(-slot_nats_);
  double mass = 0.0;  // of the slots from i on, as so many bins at the upper edge of slot i
  std::size_t from = slots;
  for (; from > 0; --from) {
    const std::size_t i = from - 1;
    mass *= decay;
    if (bins[i] > 0) {
      mass += static_cast<double>(bins[i]);
      const double log_room = log_allowance - upper_edge(i);
      if (log_room < most_log_bins && std::log(mass) > log_room) {
        break;
      }
    }
  }
  return from;
}

std::size_t UnsettledMass::droppable_from(double log_allowance) const {
  std::array<std::int64_t, slots> all{};
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    all[i % slots] += bins_[i];
  }
  return droppable_from(all.data(), log_allowance);
}

std::size_t UnsettledMass::droppable_from(std::size_t hypothesis, double log_allowance) const {
  return droppable_from(bins_.data() + hypothesis * slots, log_allowance);
}

double UnsettledMass::log_mass(std::size_t hypothesis) const {
  const std::int64_t* bins = bins_.data() + hypothesis * slots;
  std::size_t first = 0;
  while (first < slots && bins[first] == 0) {
    ++first;
  }
  if (first == slots) {
    return -std::numeric_limits<double>::infinity();
  }
  const double decay = std::exp(-slot_nats_);
  double mass = 0.0;  // of the slots from i on, as so many bins at the upper edge of slot i
  for (std::size_t i = slots; i-- > first;) {
    mass = mass * decay + static_cast<double>(bins[i]);
  }
  return upper_edge(first) + std::log(mass);
}

double UnsettledMass::largest(std::size_t hypothesis) const {
  for (std::size_t i = 0; i < slots; ++i) {
    if (bins_[hypothesis * slots + i] > 0) {
      return upper_edge(i);
    }
  }
  return -std::numeric_limits<double>::infinity();
}

}  // namespace palpate
