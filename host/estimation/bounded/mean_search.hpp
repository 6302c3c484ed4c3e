#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
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
/// object and theta, a plane, is searched by itself, from the largest tiles down. Tiles whose
/// bounds lie below a threshold are left out and counted by their bounds, in whole penalties; all
/// others are divided, and the bins of the smallest ones evaluated.
class MeanSearch {
 public:
  /// @param options checked, with a resolved contact model; these, space and likelihood outlive
  /// this object
  /// @param known the touch's known_elements()
  MeanSearch(const SearchSpace& space, const BoundedOptions& options,
             const BinLikelihood& likelihood, const TouchEvidence& touch, KnownElements known);

  /// Bounds of the log of the mean.
  /// @param least log of a mean: tiles are left out where their bins would have less than it on
  /// average, and the smallest tiles a little above. Infinity leaves all to the bounds of the
  /// largest tiles.
  /// @returns nothing where the deadline passed. On the threads of the caller's arena; the bits do
  /// not depend on their number.
  std::optional<LogInterval> bounds(double least, const Deadline& deadline);
  /// Log of the share of the bins that count among all, by prior weight; 0 before bounds().
  double log_share() const { return log_share_; }
  /// Host memory of what is kept of planes and elements, in bytes.
  std::uint64_t bytes() const {
    return surveys_.capacity() * sizeof(Survey) + reaches_.capacity() * sizeof(BoundingBox) +
           elements_.from_pivot_mm.capacity() * sizeof(glm::dvec2);
  }

 private:
  class Division;
  static constexpr double nothing = -std::numeric_limits<double>::infinity();

  /// What the largest tiles of a plane tell.
  struct Survey {
    std::int64_t bins = 0;      ///< that count
    std::int64_t off_map = 0;   ///< of these, bins at which every element sees the prior
    double best = nothing;      ///< the largest bound, in nats, with the prior weight
    double left_out = nothing;  ///< log of what the tiles that see the map hold at most, with it
  };

  /// Calls work(division, first, end) for all planes, places in surveys_, in parallel, a few of an
  /// object together.
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
  std::vector<std::vector<double>> unpenalised_;  ///< [object][level]; see unpenalised()
  std::vector<double> prior_log_likelihood_;      ///< [object] with the weight
  std::vector<double> errors_;                    ///< [object] of a bin, in nats
  bool everywhere_ = false;                       ///< all bins count
  std::vector<Survey> surveys_;     ///< [object, theta]; empty before the first bounds()
  double log_bins_ = 0.0;           ///< of the number of bins that count
  double log_weighted_bins_ = 0.0;  ///< of the sum of their prior weights
  double log_share_ = 0.0;
};

}  // namespace palpate
