#include "estimation/bounded/search/unsettled_mass.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

/// Calls visit(slot) for the slots of a set, the last one first, until it returns false.
template <typename Set, typename Visit>
void for_slots(const Set& set, const Visit& visit) {
  for (std::size_t word = set.size(); word-- > 0;) {
    for (std::uint64_t left = set[word]; left != 0;) {
      const std::size_t bit = 63 - static_cast<std::size_t>(std::countl_zero(left));
      left ^= std::uint64_t{1} << bit;
      if (!visit(64 * word + bit)) {
        return;
      }
    }
  }
}

}  // namespace

UnsettledMass::UnsettledMass(std::size_t hypotheses, double largest, double slot_nats)
    : largest_(largest), slot_nats_(slot_nats), bins_(hypotheses * slots), used_(hypotheses) {
  for (std::size_t i = 0; i < decay_.size(); ++i) {
    decay_[i] = std::exp(-static_cast<double>(i) * slot_nats);
  }
}

std::size_t UnsettledMass::slot(double bound) const {
  // Rounded down, so that a bound does not exceed its slot's upper edge, but for rounding.
  const double below = (largest_ - bound) / slot_nats_;
  return below >= static_cast<double>(slots - 1) ? slots - 1
                                                 : static_cast<std::size_t>(std::max(below, 0.0));
}

double UnsettledMass::upper_edge(std::size_t slot) const {
  return largest_ - static_cast<double>(slot) * slot_nats_;
}

template <typename Bins>
std::size_t UnsettledMass::droppable_from(const SlotSet& used, const Bins& bins_in,
                                          double log_allowance) const {
  // The log of any number of bins is less.
  constexpr double most_log_bins = 44.0;
  double mass = 0.0;  // of the slots from `above` on, as so many bins at its upper edge
  std::size_t above = slots;
  std::size_t from = 0;
  for_slots(used, [&](std::size_t i) {
    if (const std::int64_t bins = bins_in(i); bins > 0) {
      mass = mass * decay(above - i) + static_cast<double>(bins);
      above = i;
      const double log_room = log_allowance - upper_edge(i);
      if (log_room < most_log_bins && std::log(mass) > log_room) {
        from = i + 1;
        return false;
      }
    }
    return true;
  });
  return from;
}

std::size_t UnsettledMass::droppable_from(double log_allowance) const {
  SlotSet used{};
  for (const SlotSet& of : used_) {
    for (std::size_t word = 0; word < used.size(); ++word) {
      used[word] |= of[word];
    }
  }
  return droppable_from(
      used,
      [&](std::size_t slot) {
        std::int64_t bins = 0;
        for (std::size_t i = slot; i < bins_.size(); i += slots) {
          bins += bins_[i];
        }
        return bins;
      },
      log_allowance);
}

std::size_t UnsettledMass::droppable_from(std::size_t hypothesis, double log_allowance) const {
  return droppable_from(
      used_[hypothesis], [&](std::size_t slot) { return bins_[hypothesis * slots + slot]; },
      log_allowance);
}

double UnsettledMass::log_mass(std::size_t hypothesis) const {
  double mass = 0.0;  // of the slots from `above` on, as so many bins at its upper edge
  std::size_t above = slots;
  for_slots(used_[hypothesis], [&](std::size_t i) {
    if (const std::int64_t bins = bins_[hypothesis * slots + i]; bins > 0) {
      mass = mass * decay(above - i) + static_cast<double>(bins);
      above = i;
    }
    return true;
  });
  return upper_edge(above) + std::log(mass);
}

double UnsettledMass::largest(std::size_t hypothesis) const {
  const SlotSet& used = used_[hypothesis];
  for (std::size_t word = 0; word < used.size(); ++word) {
    for (std::uint64_t left = used[word]; left != 0; left &= left - 1) {
      const std::size_t i = 64 * word + static_cast<std::size_t>(std::countr_zero(left));
      if (bins_[hypothesis * slots + i] > 0) {
        return upper_edge(i);
      }
    }
  }
  return -std::numeric_limits<double>::infinity();
}

}  // namespace palpate
