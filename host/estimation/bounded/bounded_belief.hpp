#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimation/bounded/evaluated_bins.hpp"
#include "estimation/bounded/searched_touches.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// What a BoundedPosterior believes: the touches, and what the last search through all of them
/// found. Whoever asks for what is not found yet has it searched for.
class BoundedBelief {
 public:
  /// @param options checked, with a resolved contact model
  BoundedBelief(std::span<const Hypothesis> hypotheses, const BoundedOptions& options)
      : touches_(hypotheses, options) {}

  void reset();
  /// @throws Error after the first touch
  void move_pivot(const glm::dvec2& pivot_mm);
  /// The touches that are kept for take_in(), to be added to.
  KeptTouches& kept() { return touches_.kept(); }
  /// Takes in the touches that were kept, and forgets what was found without them. All below is
  /// about the touches that were taken in.
  /// @throws Error where memory ended in the middle of it, until reset()
  void take_in();

  const SearchedTouches& touches() const { return touches_; }
  /// See SearchedTouches.
  std::vector<double> log_likelihood(std::span<const BinBox> boxes) const {
    return touches_.log_likelihood(boxes);
  }
  std::uint64_t bytes() const { return touches_.bytes() + (found_ ? found_->bins.bytes() : 0); }

  /// The result of a search to the tolerance, or as far as the options' budget reaches. Bounds
  /// "none of these" beside it. What was found within a smaller tolerance stays.
  /// @param tolerance where none is given, that of the last search of these touches, and before one
  /// that of the options
  const SearchResult& found(std::optional<double> tolerance = {});
  /// Visits the bins that the last search evaluated; searches again where there was no room to keep
  /// them.
  void visit(const BinVisitor& visitor);
  /// Log of the summed likelihood of these bins, with prior weights.
  double log_total() const { return found_->result.all().evaluated; }
  /// Draws from the bins that found() evaluates.
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed);
  /// The blocks that a search divides or evaluates.
  std::vector<PoseBlock> refined_blocks();
  /// Bounds of the log evidence of "none of these" with its prior weight, as SearchResult::mass
  /// has that of the hypotheses: within 0.05 nats, or known to lie so far from the evidence of the
  /// hypotheses that the tolerance leaves one of them out, or as far as the budget reaches; within
  /// evidence_nats or beyond evidence_range_nats where the options ask for these. -infinity where
  /// it is left out. To be asked for after found().
  LogInterval none_log_evidence() const;
  /// The log evidence of "none of these" that estimates count with: the middle of its bounds, or
  /// where a budget left it or the hypotheses untold, its prior odds, as far as the bounds allow.
  double none_estimate() const;

 private:
  /// What a search found of all touches.
  struct Found {
    SearchResult result;
    EvaluatedBins bins;
    SearchGoal goal;                       ///< that the search reached
    double tolerance = 0.0;                ///< that found() was asked for
    std::optional<LogInterval> none = {};  ///< none_log_evidence(), once it is bounded
  };

  const BoundedOptions& options() const { return touches_.options(); }
  Deadline until(const std::optional<double>& budget_s) const {
    return Deadline(budget_s, &options().cancel_point);
  }
  /// The goal that the options and a tolerance set.
  SearchGoal goal(double tolerance) const;
  /// found()'s where none is given.
  double tolerance() const { return found_ ? found_->tolerance : options().tolerance; }

  /// Searches to the tolerance, or as far as the options' budget reaches.
  Found search(double tolerance);
  /// Ends the deadline where there is no room for more bins.
  Found search(const SearchGoal& goal, Deadline& deadline);
  /// Whether the later of two searches through the same touches is to be kept.
  static bool better(const Found& later, const Found& earlier) {
    return later.result.unproven() < earlier.result.unproven();
  }
  /// Whether the bounds of "none of these" are as close as the options ask for.
  bool close_enough(const LogInterval& none) const;

  SearchedTouches touches_;
  std::optional<Found> found_;  ///< nothing before a search
};

}  // namespace palpate
