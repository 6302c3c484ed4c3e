#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "bin_likelihood.hpp"
#include "known_elements.hpp"
#include "log_sum.hpp"
#include "palpate/bounded_posterior.hpp"
#include "tile_bounds.hpp"
#include "unsettled_mass.hpp"

namespace palpate {

/// What a search found out about one hypothesis: logs in nats, with its prior weight.
struct HypothesisEvidence {
  double evaluated = 0.0;  ///< of the summed likelihood of the bins that were evaluated
  double rounding = 0.0;   ///< of the bound of that sum's error
  double dropped = 0.0;    ///< of the bound of the summed likelihood of all other bins
};

/// What a search by bounds returns.
struct SearchResult {
  std::vector<HypothesisEvidence> evidence;  ///< [hypothesis]
  std::int32_t best_object = 0;
  std::int64_t best_bin = 0;
  double best_log_likelihood = 0.0;  ///< of the best bin, without prior weights
  bool mode_certain = false;
  std::int64_t blocks_bounded = 0;
  std::int64_t bins_evaluated = 0;
};

/// Takes bins that were evaluated, one box after another, with their log-likelihoods [y, x] in
/// nats; a single number stands for all bins of its box.
using BinVisitor = std::function<void(const BinBox&, std::span<const double>)>;

/// The last step of a search by bounds: evaluates the bins of the smallest tiles in the order of
/// their bounds, and keeps account of the mass that was evaluated, rounded and dropped.
class LeafPass {
 public:
  LeafPass(const BinLikelihood& likelihood, std::span<const TileBounds> bounds,
           std::span<const double> log_weight, const BoundedOptions& options,
           const KnownElements& elements, const BinVisitor& visit);

  /// Evaluates the bins of some tiles only to learn how much mass there is at least. They may be
  /// evaluated again.
  void probe(std::span<const Tile> tiles);
  /// Evaluates the bins of tiles of the finest level, until those left hold at most this part of
  /// the total; drops these.
  void evaluate(std::span<const Tile> tiles, double tolerance);
  /// Counts the mass of the tiles that are left out.
  void drop(const UnsettledMass& tiles);
  /// Counts bins at which every element sees the prior.
  void settle_unseen(const BinBox& box);

  UnsettledMass unsettled(std::span<const Tile> tiles, std::size_t level) const;
  /// For every hypothesis the slot from which on its tiles can be dropped, where they may hold this
  /// part of the total.
  std::vector<std::size_t> droppable_from(const UnsettledMass& tiles, double tolerance) const;

  /// What was dropped so far as a part of the total, at most.
  double dropped_share() const;
  bool out_of_time() const;

  SearchResult result() const;

 private:
  /// A leaf and what its evaluation gave.
  struct Leaf {
    BinBox box;
    std::size_t first = 0;  ///< of its values
    double log_mass = 0.0;  ///< without the prior weight
    double largest = 0.0;
  };

  BinBox box_of(const Tile& tile) const;
  std::vector<Leaf> leaves_of(std::span<const Tile> tiles) const;
  /// Evaluates leaves in this precision.
  template <typename Float>
  void evaluate_leaves(std::span<Leaf> leaves, std::span<double> values) const;
  void evaluate_batch(std::span<const Tile> tiles);
  /// Which leaves must be evaluated in float64, for rounding to stay within its part of the
  /// tolerance.
  std::vector<Leaf*> to_be_refined(std::span<Leaf> leaves) const;
  void account(const Leaf& leaf, std::span<const double> values, double error);
  /// Raises the lower bounds of the totals.
  void note_totals();
  void note_best(const BinBox& box, std::int64_t bin_of_box, double log_likelihood);

  const BinLikelihood& likelihood_;
  std::span<const TileBounds> bounds_;
  std::span<const double> log_weight_;
  const BoundedOptions& options_;
  const KnownElements& elements_;
  const BinVisitor& visit_;
  std::optional<std::chrono::steady_clock::time_point> deadline_;
  std::vector<double> float32_error_;  ///< [hypothesis]
  std::vector<double> float64_error_;
  std::vector<LogSum> evaluated_;  ///< [hypothesis], with the prior weight
  std::vector<LogSum> rounding_;
  std::vector<LogSum> dropped_;
  LogSum all_evaluated_;
  LogSum all_rounding_;
  LogSum all_dropped_;
  double log_total_;                      ///< lower bound of the log of the total mass, in nats
  std::vector<double> log_totals_;        ///< [hypothesis] the same of each
  std::vector<double> prior_likelihood_;  ///< [hypothesis] log, of all elements
  double best_;             ///< what the best bin has at least, with the prior weight, in nats
  double largest_dropped_;  ///< bound of a bin
  double mode_value_;       ///< of the best bin that was evaluated, with the prior weight
  SearchResult result_;
};

}  // namespace palpate
