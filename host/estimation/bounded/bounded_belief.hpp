#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tbb/task_arena.h>

#include "estimation/bounded/evaluated_bins.hpp"
#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/moving/moving_belief.hpp"
#include "estimation/bounded/none_evidence.hpp"
#include "estimation/bounded/search/bound_search.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/change_in_steps.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// What a BoundedPosterior believes: the touches so far, and what searches have found of them.
/// add() only keeps touches; take_in() brings all that follows from them in step, but for what is
/// found, which waits until it is asked for.
class BoundedBelief {
 public:
  /// @param options checked, with a resolved contact model
  BoundedBelief(std::span<const Hypothesis> hypotheses, const BoundedOptions& options);

  void reset();
  void move_pivot(const glm::dvec2& pivot_mm);
  /// Keeps touches for take_in(): all, or none where one is not sound.
  void add(std::span<const Touch> touches);
  /// Takes in the touches that were kept. All below is about the touches that were taken in.
  /// @throws Error where memory ended in the middle of it, until reset()
  void take_in();

  const KnownElements& elements() const { return elements_; }
  const BoundedOptions& options() const { return options_; }
  const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  const BinLikelihood& likelihood() const { return likelihood_; }
  /// Log-likelihood of bins, box after box, [y, x] in each, in nats; see MovingBelief where objects
  /// slip.
  std::vector<double> log_likelihood(std::span<const BinBox> boxes, Arithmetic arithmetic);
  /// Whether touches were taken in.
  bool touched() const { return taken_in_ > 0; }
  /// [hypothesis] log of its prior weight.
  const std::vector<double>& log_weight() const { return space_.log_weight; }
  std::string path() const;
  std::uint64_t bytes() const;
  /// Runs work on the threads that the options ask for.
  template <typename Work>
  decltype(auto) on_threads(const Work& work) const {
    return arena_.execute(work);
  }

  /// The result of a search to the options' tolerance, or as far as their budget reaches. Bounds
  /// "none of these" beside it.
  const SearchResult& found();
  /// Visits the bins that the last search evaluated; searches again where there was no room to keep
  /// them.
  void visit(const BinVisitor& visitor);
  /// Log of the summed likelihood of these bins, with prior weights.
  double log_total() const { return found_->result.all().evaluated; }
  /// Draws from the bins of the last search, or where there are none, or too many to keep, from
  /// bins that hold nearly all of the belief.
  std::vector<PoseSample> sample(std::size_t count, std::uint64_t seed);
  /// The blocks that a search divides or evaluates.
  std::vector<PoseBlock> refined_blocks();

  /// Whether the options ask for "none of these".
  bool has_none() const { return none_.has_value(); }
  /// Bounds of the log evidence of "none of these" with its prior weight, as SearchResult::mass
  /// has that of the hypotheses: within 0.05 nats, or known to lie so far from the evidence of the
  /// hypotheses that the tolerance leaves one of them out, or as far as the budget reaches; within
  /// evidence_nats or beyond evidence_range_nats where the options ask for these. -infinity where
  /// it is left out. To be asked for after found().
  LogInterval none_log_evidence() const;

 private:
  /// What a search found of all touches.
  struct Found {
    SearchResult result;
    EvaluatedBins bins;
    SearchGoal goal;                       ///< that the search reached
    std::optional<LogInterval> none = {};  ///< none_log_evidence(), once it is bounded
  };

  /// The goal that the options set.
  SearchGoal goal() const;
  double bins_in_all() const;
  /// What a search for draws is to reach.
  SearchGoal rough_goal() const;
  /// What found() returns.
  Found search();
  /// Draws bins: those of a search where it kept them or is quick.
  std::vector<DrawnBin> draw(std::size_t count, Random& random);
  /// Follows the bins of an earlier search through the touches since.
  /// @returns whether they hold enough to draw from; forgets them otherwise
  bool follow();
  /// Ends the deadline where there is no room for more bins.
  Found run(const SearchGoal& goal, Deadline& deadline);
  SearchResult run(const SearchGoal& goal, const Deadline& deadline, const BinVisitor& visitor,
                   std::vector<PoseBlock>* refined = nullptr);
  /// Narrows the bounds of "none of these" as far as needed beside what was found.
  LogInterval bound_none(const Deadline& deadline);
  /// Whether they are known as closely as the options ask for.
  bool tells_enough(const LogInterval& none) const;
  Deadline until(const std::optional<double>& budget_s) const {
    return Deadline(budget_s, &options_.cancel_point);
  }

  BoundedOptions options_;
  std::vector<Hypothesis> hypotheses_;
  int threads_;
  mutable tbb::task_arena arena_;
  BinLikelihood likelihood_;
  SearchSpace space_;
  double none_log_weight_ = 0.0;  ///< log of its prior weight times the number of bins
  KeptTouches touches_;
  std::size_t taken_in_ = 0;              ///< of the touches
  KnownElements elements_;                ///< of all these
  BoundSearch search_;                    ///< through all these
  std::optional<MovingBelief> moving_;    ///< through all these, where objects slip
  std::optional<NoneEvidence> none_;      ///< of all these, where the options ask for it
  std::optional<Found> found_;            ///< of all these; nothing before a search
  std::optional<FollowedBins> followed_;  ///< of the last search before, through some of these
  ChangeInSteps change_{"bounded posterior: memory ended in the middle of an update; call reset()"};
};

}  // namespace palpate
