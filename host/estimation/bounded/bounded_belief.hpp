#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tbb/task_arena.h>

#include "estimation/bin_belief.hpp"
#include "estimation/bin_box.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/none_evidence.hpp"
#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/change_in_steps.hpp"
#include "estimation/known_elements.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// Keeps the bins that a search evaluated, as far as there is room for them.
class EvaluatedBins {
 public:
  /// @param keeps_all also beyond its room: the search ends soon after full()
  explicit EvaluatedBins(bool keeps_all = false) : keeps_all_(keeps_all) {}

  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood) {
    if (!complete_) {
      return;
    }
    values_.insert(values_.end(), log_likelihood.begin(), log_likelihood.end());
    boxes_.push_back({box, values_.size()});
    if (full() && !keeps_all_) {
      *this = EvaluatedBins();
      complete_ = false;
    }
  }
  /// False where there was no room for all.
  bool complete() const { return complete_; }
  /// There is no room for more.
  bool full() const {
    return boxes_.size() * sizeof(Box) + values_.size() * sizeof(double) > most_bytes;
  }
  void visit(const BinVisitor& visit) const {
    std::size_t first = 0;
    for (const Box& box : boxes_) {
      visit(box.bins, std::span(values_).subspan(first, box.values_end - first));
      first = box.values_end;
    }
  }
  std::uint64_t bytes() const {
    return boxes_.capacity() * sizeof(Box) + values_.capacity() * sizeof(double);
  }

 private:
  struct Box {
    BinBox bins;
    std::size_t values_end = 0;  ///< in values_
  };
  /// Together with the vectors' growth within some 160 MiB.
  static constexpr std::uint64_t most_bytes = std::uint64_t{80} << 20;

  bool keeps_all_;
  std::vector<Box> boxes_;
  std::vector<double> values_;
  bool complete_ = true;
};

/// What a BoundedPosterior believes: the touches, and what the last search through all of them
/// found. Touches are only kept at first; take_in() brings everything that searches go through in
/// step. Whoever asks for what is not found yet has it searched for.
class BoundedBelief {
 public:
  /// @param options checked, with a resolved contact model
  BoundedBelief(std::span<const Hypothesis> hypotheses, const BoundedOptions& options);
  BoundedBelief(const BoundedBelief&) = delete;  // its parts refer to each other
  BoundedBelief& operator=(const BoundedBelief&) = delete;

  void reset();
  /// @throws Error after the first touch
  void move_pivot(const glm::dvec2& pivot_mm);
  /// The touches that are kept for take_in(), to be added to.
  /// @throws Error where memory ended in the middle of take_in(), until reset()
  KeptTouches& kept();
  /// Takes in the touches that were kept, and forgets what was found without them. All below is
  /// about the touches that were taken in.
  /// @throws Error as kept() does
  void take_in();

  const BoundedOptions& options() const { return options_; }
  const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  const KnownElements& elements() const { return elements_; }
  const BinLikelihood& likelihood() const { return likelihood_; }
  /// [hypothesis] log of its prior weight
  const std::vector<double>& log_weight() const { return space_.log_weight; }
  /// How blocks are bounded and bins evaluated.
  std::string path() const;
  /// Host memory, in bytes.
  std::uint64_t bytes() const;

  /// Log-likelihood of bins, box after box, [y, x] in each, in nats.
  /// @param likelihood over the lattice that the boxes are of
  std::vector<double> log_likelihood(std::span<const BinBox> boxes,
                                     const BinLikelihood& likelihood) const;

  /// The result of a search to the tolerance, or as far as the options' budget reaches. Bounds
  /// "none of these" beside it. What was found within a smaller tolerance stays.
  /// @param tolerance where none is given, that of the last search of these touches, and before one
  /// that of the options
  const SearchResult& found(std::optional<double> tolerance = {});
  /// Visits the bins that found() evaluates; searches again where there was no room to keep them.
  void visit(const BinVisitor& visitor);
  /// The bins that found() evaluates, to be asked.
  BinBelief bins();
  /// The blocks that a search divides or evaluates.
  std::vector<PoseBlock> refined_blocks();

  /// Whether the options ask for "none of these".
  bool has_none() const { return none_.has_value(); }
  /// Bounds of the log evidence of "none of these" with its prior weight, as SearchResult::mass
  /// has that of the hypotheses: within 0.3 nats, or known to lie so far from the evidence of the
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

  Deadline until(const std::optional<double>& budget_s) const {
    return Deadline(budget_s, &options_.cancel_point);
  }
  /// The goal that the options and a tolerance set.
  SearchGoal goal(double tolerance) const;
  /// found()'s where none is given.
  double tolerance() const { return found_ ? found_->tolerance : options_.tolerance; }

  /// Searches to the tolerance, or as far as the options' budget reaches.
  Found find(double tolerance);
  /// With a budget, ends the search once there is no room to keep more bins.
  Found find(const SearchGoal& goal, Deadline& deadline);
  /// @param refined where not null, takes the tiles that are divided
  SearchResult search(const SearchGoal& goal, const Deadline& deadline, const BinVisitor& visitor,
                      std::vector<PoseBlock>* refined = nullptr);
  /// Whether the later of two searches through the same touches is to be kept.
  static bool better(const Found& later, const Found& earlier) {
    return later.result.unproven() < earlier.result.unproven();
  }
  LogInterval bound_none(const Deadline& deadline);
  /// Whether the bounds of "none of these" are as close as the options ask for.
  bool close_enough(const LogInterval& none) const;

  BoundedOptions options_;
  std::vector<Hypothesis> hypotheses_;
  mutable tbb::task_arena arena_;
  BinLikelihood likelihood_;
  SearchSpace space_;
  double none_log_weight_ = 0.0;  ///< log of its prior weight times the number of bins
  KeptTouches touches_;
  std::size_t taken_in_ = 0;          ///< of the touches
  std::size_t informative_ = 0;       ///< of these, see TouchEvidence::tells()
  KnownElements elements_;            ///< of all these
  LargestTiles largest_;              ///< of all these
  std::optional<NoneEvidence> none_;  ///< of all these, where the options ask for it
  ChangeInSteps change_{"bounded posterior: memory ended in the middle of an update; call reset()"};
  std::optional<Found> found_;  ///< nothing before a search
};

}  // namespace palpate
