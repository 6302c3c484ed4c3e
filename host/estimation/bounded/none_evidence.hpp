#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/plane_division.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"
#include "estimation/touch_overlap.hpp"
#include "model/bounding_box.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/estimate.hpp"

namespace palpate {

/// Bounds one touch's mean likelihood over the bins at which its array overlaps an object, or over
/// all bins where there is no such bin, by prior weight. The touch counts as if it lay where the
/// robot says: a displacement moves likelihood between neighbouring bins, and changes their mean at
/// the edge of the overlap alone.
///
/// A mean is wide: thousands of bins hold it, and no order of tiles is worth keeping. So every
/// object and theta is searched by itself, from the largest tiles down. Tiles whose bounds lie
/// below a threshold are left out and counted by their bounds; all others are divided, and the bins
/// of the smallest ones evaluated.
class MeanSearch {
 public:
  /// @param options checked, with a resolved contact model; these, space and likelihood outlive
  /// this object
  /// @param known the touch's known_elements()
  /// @param most_bytes for the sums of the largest tiles, which are kept where they need no more
  MeanSearch(const SearchSpace& space, const BoundedOptions& options,
             const BinLikelihood& likelihood, const TouchEvidence& touch, KnownElements known,
             std::size_t most_bytes);

  /// Bounds of the log of the mean.
  /// @param least log of a mean: tiles are left out where their bins would have less than it on
  /// average, and the smallest tiles a little above. Infinity leaves all to the bounds of the
  /// largest tiles.
  /// @returns nothing where the deadline passed. On the threads of the caller's arena; the bits do
  /// not depend on their number.
  std::optional<LogInterval> bounds(double least, const Deadline& deadline);
  /// Log of the share of the bins that count among all, by prior weight; 0 before bounds().
  double log_share() const { return log_share_; }
  /// Host memory of what searches keep.
  std::uint64_t bytes() const;

 private:
  static constexpr double nothing = PlaneSurvey::nothing;

  /// What planes are given.
  MeanTask task() const {
    return {space_,   options_.lattice, likelihood_, elements_,
            reaches_, unpenalised_,     rectangle_,  everywhere_};
  }
  /// Calls work(object, first theta, end) for all planes, in parallel, a few of them together.
  /// @returns false where the deadline passed
  template <typename Work>
  bool for_planes(const Deadline& deadline, const Work& work) const;
  /// Finds the bins that count, and looks at the largest tiles of all planes.
  /// @returns false where the deadline passed
  bool survey(const Deadline& deadline);

  const SearchSpace& space_;
  const BoundedOptions& options_;
  const BinLikelihood& likelihood_;
  KnownElements elements_;
  ArrayRectangle rectangle_;
  std::vector<BoundingBox> reaches_;              ///< [theta] of the elements
  std::vector<std::vector<double>> unpenalised_;  ///< [object][level]
  std::vector<double> prior_log_likelihood_;      ///< [object] with the weight
  std::vector<double> errors_;                    ///< [object] of a bin, in nats
  bool everywhere_ = false;                       ///< all bins count
  std::vector<PlaneSurvey> surveys_;  ///< [object, theta]; empty before the first bounds()
  std::vector<PlaneDivision::LargestSums> sums_;  ///< as the surveys, empty where none are kept
  bool keep_sums_;
  double log_bins_ = 0.0;           ///< of the number of bins that count
  double log_weighted_bins_ = 0.0;  ///< of the sum of their prior weights
  double log_share_ = 0.0;
};

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
  /// Host memory of what searches keep.
  std::uint64_t bytes() const;

 private:
  /// What is known of one touch.
  struct TouchMean {
    MeanSearch search;
    /// Bounds of the log of the mean before any search, and after each that no deadline ended.
    LogInterval before{-std::numeric_limits<double>::infinity(),
                       -std::numeric_limits<double>::infinity()};
    std::vector<LogInterval> found = {};
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
