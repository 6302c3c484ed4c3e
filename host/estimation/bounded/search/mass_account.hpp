#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/log_sum.hpp"
#include "palpate/lattice.hpp"

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
  std::size_t droppable_from(double log_allowance) const {
    return droppable_from({0, used_.size()}, log_allowance);
  }
  /// The first slot from which on one hypothesis's tiles hold at most this mass, in nats.
  std::size_t droppable_from(std::size_t hypothesis, double log_allowance) const {
    return droppable_from({hypothesis, hypothesis + 1}, log_allowance);
  }
  /// Bound of the log of a hypothesis's summed likelihood, in nats.
  double log_mass(std::size_t hypothesis) const;
  /// The largest bound that a tile of a hypothesis may have, in nats; -infinity without any.
  double largest(std::size_t hypothesis) const;

  static constexpr std::size_t slots = 4096;

 private:
  /// A bit for every slot.
  using SlotSet = std::array<std::uint64_t, slots / 64>;

  /// The summed mass of the slots from `slot` on, as so many bins at its upper edge.
  struct Reached {
    double bins = 0.0;
    std::size_t slot = slots;
  };

  /// Some neighbouring hypotheses.
  struct Hypotheses {
    std::size_t first;
    std::size_t end;
  };

  /// Adds up slots from the last one on, until `visit`, after each that holds bins, returns false.
  template <typename Visit>
  Reached add_up(const Hypotheses& of, const Visit& visit) const;
  Reached add_up(std::size_t hypothesis) const;
  std::size_t droppable_from(const Hypotheses& of, double log_allowance) const;
  /// The bound that no tile in a slot exceeds, in nats.
  double upper_edge(std::size_t slot) const {
    return largest_ - static_cast<double>(slot) * slot_nats_;
  }
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

/// Keeps account of a search: of the mass that was settled, by evaluating bins, with the error of
/// rounding, and of the mass that was dropped. Says which tiles may be dropped.
class MassAccount {
 public:
  /// @param label_of [hypothesis] index of its label
  MassAccount(std::span<const double> log_weight, std::span<const std::size_t> label_of,
              const PoseLattice& lattice, const SearchGoal& goal);

  /// Counts so many bins whose summed likelihood is exp(log_mass), each within exp(+-error).
  /// @param largest log-likelihood of these bins; without the prior weight, as log_mass is
  void settle(std::int32_t object, std::int64_t bins, double log_mass, double largest,
              double error);
  /// Counts the mass of all tiles that are left.
  void drop(const UnsettledMass& tiles);
  /// Notes the best of some settled bins.
  /// @param bin_of_box index of the bin in the box, [y, x]
  void note_best(const BinBox& box, std::int64_t bin_of_box, double log_likelihood);

  /// Width of the slots in which unsettled mass is counted, given the largest bound. The slots
  /// reach from there to below all that matters: after many touches, the bounds of large tiles lie
  /// hundreds of nats above the total. They are fine where only a tolerance is asked for. Where
  /// labels that lie hundreds of nats apart count, they are as wide as the evidence's nats allow.
  double slot_nats(double largest) const;

  /// Raises the lower bounds of the totals by what was settled.
  void raise_totals();
  /// A bin of the hypothesis has at least this log-likelihood, without the prior weight.
  void raise_best(std::int32_t object, double log_likelihood);

  /// For every hypothesis the slot from which on its tiles can be dropped, where they may hold this
  /// part of the total.
  std::vector<std::size_t> droppable_from(const UnsettledMass& tiles, double tolerance) const;
  /// What was dropped so far as a part of the total, at most.
  double dropped_share() const { return std::exp(all_dropped_.log() - log_total_); }
  /// Lower bound of the log of the total mass, in nats.
  double log_total() const { return log_total_; }
  /// What the best bin has at least, with the prior weight, in nats.
  double best() const { return best_; }
  /// Log-likelihood, without the prior weight, that a hypothesis's best bin has at least, and that
  /// a bin of it that was dropped has at most.
  double best_of(std::size_t object) const { return of_[object].best; }
  double largest_dropped_of(std::size_t object) const { return of_[object].most_dropped; }

  /// Without the counts of blocks and bins.
  SearchResult result() const;

 private:
  /// [hypothesis] the largest log mass that evidence_nats lets a search drop.
  std::vector<double> droppable_evidence(double tolerance) const;

  /// What is known of a hypothesis: logs in nats, with its prior weight.
  struct Account {
    LogSum evaluated;
    LogSum rounding;
    LogSum dropped;
    double terms = 0.0;             ///< of the sums
    double log_total = nothing;     ///< lower bound
    double best = nothing;          ///< see best_of(), without the prior weight as the next is
    double most_dropped = nothing;  ///< see largest_dropped_of()
  };
  static constexpr double nothing = -std::numeric_limits<double>::infinity();

  std::span<const double> log_weight_;
  std::span<const std::size_t> label_of_;
  const PoseLattice& lattice_;
  const SearchGoal& goal_;
  std::vector<Account> of_;  ///< [hypothesis]
  LogSum all_dropped_;
  double log_total_ = nothing;
  double best_ = nothing;        ///< what the best bin has at least, with the prior weight, in nats
  double mode_value_ = nothing;  ///< of the best settled bin, with the prior weight
  std::int32_t mode_object_ = 0;
  std::int64_t mode_bin_ = 0;
};

}  // namespace palpate
