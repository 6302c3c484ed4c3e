#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/mean_search.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/estimate.hpp"

namespace palpate {

/// "None of these" by bounds: the log evidence
///   log s + sum over the touches of log (mean of the touch's likelihood),
/// where the mean is over the bins at which the array overlaps the object (over all bins where
/// there is no such bin) and s is the share of such bins at the first touch with a known element.
///
/// The bins of s are counted exactly. Each mean comes from searches of its own over the touch's
/// elements: what was evaluated bounds it from below, and the bounds of what was left out from
/// above.
class NoneEvidence {
 public:
  /// Whether bounds are close enough.
  using Enough = std::function<bool(const LogInterval&)>;

  /// @param options checked, with a resolved contact model
  /// @param likelihood evaluates bins; all of these outlive this object
  NoneEvidence(const SearchSpace& space, const BoundedOptions& options,
               const BinLikelihood& likelihood)
      : space_(space), options_(options), likelihood_(likelihood) {}

  void reset() { means_.clear(); }
  /// Takes in touches; those without a known element say nothing. All of them, or none where memory
  /// ends.
  void add(std::span<const TouchEvidence> touches);

  /// Bounds of the log of the product of s and the touches' mean likelihoods, in nats; 0 before any
  /// touch. Searches on, for the touch whose mean is known worst, until they are enough, or
  /// rounding allows no closer ones, or the deadline has passed. Unless a deadline passed, they
  /// depend on the touches and on what is enough alone. On the threads of the caller's arena; the
  /// bits do not depend on their number.
  /// @throws what the deadline's cancel point throws
  LogInterval bounds(const Enough& enough, const Deadline& deadline);
  /// Host memory of what is kept of the touches, in bytes.
  std::uint64_t bytes() const;

 private:
  /// What is known of one touch.
  struct TouchMean {
    MeanSearch search;
    /// Bounds of the log of the mean: before any search, and after each that no deadline ended.
    std::vector<LogInterval> found;
    std::size_t close_searches = 0;  ///< see left_out_nats
    bool closest = false;            ///< the last search came as close as any
  };

  /// Searches a touch once more. @returns false where the deadline passed
  static bool search(TouchMean& mean, const Deadline& deadline);

  const SearchSpace& space_;
  const BoundedOptions& options_;
  const BinLikelihood& likelihood_;
  std::vector<TouchMean> means_;
};

}  // namespace palpate
