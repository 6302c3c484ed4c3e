#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// Bins whose tiles are neither evaluated nor dropped, counted by hypothesis and by their tile's
/// bound in slots of equal width: finds which tiles can be dropped together without sorting them.
class UnsettledMass {
 public:
  static constexpr double usual_slot_nats = 1.0 / 16.0;

  /// @param largest of all bounds, in nats
  /// @param slot_nats width of a slot; all bounds that lie 4095 slots below the largest or deeper
  /// count as if they lay there
  UnsettledMass(std::size_t hypotheses, double largest, double slot_nats = usual_slot_nats);

  /// Slots ascend as bounds fall; the last holds all that lie far below.
  std::size_t slot(double bound) const;
  void add(std::size_t hypothesis, double bound, std::int64_t bins) {
    const std::size_t i = slot(bound);
    bins_[hypothesis * slots + i] += bins;
    used_[hypothesis][i / 64] |= std::uint64_t{1} << (i % 64);
  }
  void remove(std::size_t hypothesis, double bound, std::int64_t bins) {
    bins_[hypothesis * slots + slot(bound)] -= bins;
  }

  /// The first slot from which on all tiles together hold at most this mass, in nats.
  std::size_t droppable_from(double log_allowance) const;
  /// The first slot from which on one hypothesis's tiles hold at most this mass, in nats.
  std::size_t droppable_from(std::size_t hypothesis, double log_allowance) const;
  /// Bound of the log of a hypothesis's summed likelihood, in nats.
  double log_mass(std::size_t hypothesis) const;
  /// The largest bound that a tile of a hypothesis may have, in nats; -infinity without any.
  double largest(std::size_t hypothesis) const;

  static constexpr std::size_t slots = 4096;

 private:
  /// A bit for every slot.
  using SlotSet = std::array<std::uint64_t, slots / 64>;

  /// The bound that no tile in a slot exceeds, in nats.
  double upper_edge(std::size_t slot) const;
  /// @param used slots that may hold bins
  /// @param bins_in(slot) their number
  template <typename Bins>
  std::size_t droppable_from(const SlotSet& used, const Bins& bins_in, double log_allowance) const;
  /// What a bin counts for, that many slots further up.
  double decay(std::size_t slots_up) const {
    return slots_up < decay_.size() ? decay_[slots_up]
                                    : std::exp(-static_cast<double>(slots_up) * slot_nats_);
  }

  double largest_;
  double slot_nats_;
  std::array<double, 32> decay_{};  ///< [slots up] of neighbours
  std::vector<std::int64_t> bins_;  ///< [hypothesis, slot]
  std::vector<SlotSet> used_;       ///< [hypothesis] slots to which bins were added
};

}  // namespace palpate
