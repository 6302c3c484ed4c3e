#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tbb/task_arena.h>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/none_evidence.hpp"
#include "estimation/bounded/search/bound_search.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/change_in_steps.hpp"
#include "estimation/known_elements.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// Touches, and searches for the poses that explain all of them. Touches are only kept at first;
/// take_in() brings everything that searches go through in step.
class SearchedTouches {
 public:
  /// @param options checked, with a resolved contact model
  SearchedTouches(std::span<const Hypothesis> hypotheses, const BoundedOptions& options);
  SearchedTouches(const SearchedTouches&) = delete;  // its searches refer to it
  SearchedTouches& operator=(const SearchedTouches&) = delete;

  void reset();
  /// @throws Error after the first touch
  void move_pivot(const glm::dvec2& pivot_mm);
  /// The touches that are kept for take_in(), to be added to.
  /// @throws Error where memory ended in the middle of it, until reset()
  KeptTouches& kept() {
    change_.refuse();
    return touches_;
  }
  /// Whether touches were kept since take_in().
  /// @throws Error where memory ended in the middle of it, until reset()
  bool waiting() const;
  /// Takes in the touches that were kept. All below is about the touches that were taken in.
  void take_in();
  std::size_t taken_in() const { return taken_in_; }
  /// Those of them that tell something.
  std::size_t informative() const { return informative_; }

  const BoundedOptions& options() const { return options_; }
  const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  const BinLikelihood& likelihood() const { return likelihood_; }
  const KnownElements& elements() const { return elements_; }
  /// [hypothesis] log of its prior weight
  const std::vector<double>& log_weight() const { return space_.log_weight; }
  std::size_t finest_level() const { return space_.finest_level(); }
  /// Whether the options ask for "none of these".
  bool has_none() const { return none_.has_value(); }
  /// Log of the prior weight of "none of these" times the number of bins. Only where has_none().
  double none_log_weight() const { return none_log_weight_; }
  std::string path() const;
  std::uint64_t bytes() const;
  /// Runs work on the threads that the options ask for.
  template <typename Work>
  decltype(auto) on_threads(const Work& work) const {
    return arena_.execute(work);
  }

  /// Searches; visits the bins that it evaluates.
  /// @param refined where not null, takes the tiles that were divided
  SearchResult search(const SearchGoal& goal, const Deadline& deadline, const BinVisitor& visitor,
                      std::vector<PoseBlock>* refined = nullptr);
  /// Log-likelihood of bins, box after box, [y, x] in each, in nats.
  std::vector<double> log_likelihood(std::span<const BinBox> boxes) const;
  /// Bounds of the log evidence of "none of these" with its prior weight, as SearchResult::mass has
  /// that of the hypotheses, see NoneEvidence::bounds(). Only where has_none().
  LogInterval bound_none(const NoneEvidence::Enough& enough, const Deadline& deadline);

 private:
  BoundedOptions options_;
  std::vector<Hypothesis> hypotheses_;
  int threads_;
  mutable tbb::task_arena arena_;
  BinLikelihood likelihood_;
  SearchSpace space_;
  double none_log_weight_ = 0.0;  ///< log of its prior weight times the number of bins
  KeptTouches touches_;
  std::size_t taken_in_ = 0;          ///< of the touches
  std::size_t informative_ = 0;       ///< of these, see TouchEvidence::tells()
  KnownElements elements_;            ///< of all these
  BoundSearch search_;                ///< through all these
  std::optional<NoneEvidence> none_;  ///< of all these, where the options ask for it
  ChangeInSteps change_{"bounded posterior: memory ended in the middle of an update; call reset()"};
};

}  // namespace palpate
