#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/log_sum.hpp"
#include "estimation/bounded/search/search_goal.hpp"
#include "estimation/bounded/search/unsettled_mass.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Part of BoundedOptions::evidence_nats that rounding may use up.
inline constexpr double evidence_rounding_part = 0.2;

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

  /// Raises the lower bounds of the totals by what was settled, together with bins that are not yet
  /// settled but known well enough.
  /// @param pending [hypothesis] lower bounds of their mass, with the prior weight
  void raise_totals(std::span<const LogSum> pending);
  /// A bin of the hypothesis has at least this log-likelihood, without the prior weight.
  void raise_best(std::int32_t object, double log_likelihood);

  /// For every hypothesis the slot from which on its tiles can be dropped, where they may hold this
  /// part of the total.
  std::vector<std::size_t> droppable_from(const UnsettledMass& tiles, double tolerance) const;
  /// What was dropped so far as a part of the total, at most.
  double dropped_share() const;
  /// What rounding may have changed so far as a part of the total, at most.
  double rounding_share() const;
  /// Lower bound of the log of the total mass, in nats.
  double log_total() const { return log_total_; }
  /// What the best bin has at least, with the prior weight, in nats.
  double best() const { return best_; }
  /// Log-likelihood, without the prior weight, that a hypothesis's best bin has at least, and that
  /// a bin of it that was dropped has at most.
  double best_of(std::size_t object) const { return best_of_[object]; }
  double largest_dropped_of(std::size_t object) const { return largest_dropped_of_[object]; }

  /// Without the counts of blocks and bins.
  SearchResult result() const;

 private:
  /// [hypothesis] the largest log mass that evidence_nats lets a search drop.
  std::vector<double> droppable_evidence(double tolerance) const;

  std::span<const double> log_weight_;
  std::span<const std::size_t> label_of_;
  const PoseLattice& lattice_;
  const SearchGoal& goal_;
  std::vector<LogSum> evaluated_;  ///< [hypothesis], with the prior weight
  std::vector<LogSum> rounding_;
  std::vector<double> terms_;  ///< [hypothesis] of the sums
  std::vector<LogSum> dropped_;
  LogSum all_rounding_;
  LogSum all_dropped_;
  double log_total_;
  std::vector<double> log_totals_;  ///< [hypothesis] the same of each
  double best_;                  ///< what the best bin has at least, with the prior weight, in nats
  std::vector<double> best_of_;  ///< [hypothesis]
  std::vector<double> largest_dropped_of_;  ///< [hypothesis]
  double mode_value_;                       ///< of the best settled bin, with the prior weight
  std::int32_t mode_object_ = 0;
  std::int64_t mode_bin_ = 0;
};

}  // namespace palpate
