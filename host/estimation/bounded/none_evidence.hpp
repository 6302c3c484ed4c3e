#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/search/bound_search.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "palpate/estimate.hpp"

namespace palpate {

/// "None of these" by bounds: the log evidence
///   log s + sum over the touches of log (mean of the touch's likelihood),
/// where the mean is over the bins at which the array overlaps the object (over all bins where
/// there is no such bin) and s is the share of such bins at the first touch with a known element.
///
/// The bins of s are counted exactly. Each mean comes from a search of its own over the touch's
/// elements: what was evaluated bounds it from below, and the bounds of what was dropped from
/// above.
class NoneEvidence {
 public:
  /// @param options checked, with a resolved contact model
  /// @param likelihood evaluates bins; all of these outlive this object
  NoneEvidence(SearchSpace& space, const BoundedOptions& options, const BinLikelihood& likelihood);

  void reset() { means_.clear(); }
  /// Takes in touches; those without a known element say nothing. All of them, or none where memory
  /// ends.
  void add(std::span<const ArrayReadings> touches);

  /// Bounds of the log of the product of s and the touches' mean likelihoods, in nats; 0 before any
  /// touch. Searches until they are at most so wide and each touch's at most some 0.01 nats, or
  /// rounding allows no less, or the deadline has passed. Unless a deadline passed, they depend on
  /// the touches and the width alone. On the threads of the caller's arena; the bits do not depend
  /// on their number.
  /// @throws what the deadline's cancel point throws
  LogInterval bounds(double width_nats, const Deadline& deadline);

  /// Host memory, in bytes.
  std::uint64_t bytes() const { return search_.largest().bytes(); }

 private:
  /// Searches to these parts of a touch's sum that may be left out, the last where rounding of
  /// float64 is not far below. Most touches' bins have likelihoods of many magnitudes, so that a
  /// coarser search than the second would save little; where touches are uncertain, the bounds of
  /// large tiles alone, which the first asks for, come within a few nats of the mean.
  static constexpr std::array<double, 10> tolerances{20.0, 0.5,  1e-2, 1e-3, 1e-4,
                                                     1e-5, 1e-6, 1e-7, 1e-8, 1e-9};

  /// What is known of one touch.
  struct TouchMean {
    ArrayReadings touch;
    double log_share = 0.0;  ///< of the bins that count among all, by prior weight, in nats
    /// [tolerance] bounds of the log of the mean, from searches that no deadline ended.
    std::array<std::optional<LogInterval>, tolerances.size()> found = {};
  };

  /// Bounds of the log of a touch's mean likelihood, so wide at most where that can be had.
  LogInterval narrow(TouchMean& mean, double width_nats, const Deadline& deadline);
  LogInterval search(TouchMean& mean, double tolerance, const Deadline& deadline);

  SearchSpace& space_;
  const BoundedOptions& options_;
  BoundSearch search_;
  std::vector<TouchMean> means_;
};

}  // namespace palpate
