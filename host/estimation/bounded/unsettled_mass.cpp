#include "unsettled_mass.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "log_sum.hpp"

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
  LogSum mass;
  std::size_t from = slots;
  for (; from > 0; --from) {
    const std::size_t i = from - 1;
    if (bins[i] > 0) {
      mass.add(upper_edge(i) + std::log(static_cast<double>(bins[i])));
      if (mass.log() > log_allowance) {
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
  LogSum mass;
  for (std::size_t i = 0; i < slots; ++i) {
    if (const std::int64_t bins = bins_[hypothesis * slots + i]; bins > 0) {
      mass.add(upper_edge(i) + std::log(static_cast<double>(bins)));
    }
  }
  return mass.log();
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
