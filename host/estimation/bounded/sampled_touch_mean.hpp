#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "array_overlap.hpp"
#include "bin_likelihood.hpp"
#include "bounding_box.hpp"
#include "known_elements.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "tile_bounds.hpp"
#include "touch_tiles.hpp"

namespace palpate {

/// Bins at which a touch's likelihood is evaluated for its mean, about.
inline constexpr std::int64_t bins_per_touch_mean = 100'000;

/// The mean likelihood of one touch, over the hypotheses by prior weight and over the bins at which
/// the touch's array overlaps the object.
struct TouchMean {
  double log_mean = 0.0;          ///< in nats
  double squared_error = 0.0;     ///< squared standard error of log_mean; 0 where all bins count
  double log_share = 0.0;         ///< of such bins among all bins, by prior weight, in nats
  std::uint64_t fingerprint = 0;  ///< of the touch's known elements
};

/// "None of these" over a lattice of any size: the log evidence
///   log s + sum over the touches of log (mean of the touch's likelihood),
/// where the mean is over the bins at which the array overlaps the object (over all bins where
/// there is no such bin) and s is the share of such bins at the first touch with a known element.
/// Counts the bins exactly. Evaluates all of them where they are few, and otherwise draws:
///
/// A touch is likely at few of its bins, so that bins are drawn where tiles' bounds say that it may
/// be. Tiles on a line, each as long as its prior weight * bins * bound of the likelihood, are cut
/// into strata of equal length; two points are drawn in each. A point's estimate is the likelihood
/// over its bound, averaged over a run of neighbouring bins of its tile: at most 1, so that no rare
/// draw decides the mean. The standard error follows from the strata's variances by the delta
/// method. The bounds decide where bins are drawn, not what the mean is.
///
/// Draws depend on the touch and on how often it has come before, so that errors of touches are
/// independent and the order of touches does not count, but for s.
class SampledTouchMeans {
 public:
  /// @param log_weight of every hypothesis, over their sum
  /// @param bounds of every hypothesis; `likelihood` has the same pivot. Both outlive this object
  SampledTouchMeans(std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
                    std::span<const double> log_weight, const BinLikelihood& likelihood,
                    std::span<const TileBounds> bounds);

  void reset();
  void move_pivot(const glm::dvec2& pivot_mm);

  /// The means of touches that come after those added so far; touches without a known element have
  /// none. On the threads of the caller's arena; the bits do not depend on their number.
  /// @param cancel_point called after each touch
  /// @throws what `cancel_point` throws
  std::vector<TouchMean> evaluate(std::span<const ArrayReadings> touches,
                                  const std::function<void()>& cancel_point = {}) const;
  /// Takes in what evaluate() returned; all of it, or nothing where memory ends.
  void add(std::span<const TouchMean> means);

  /// Log of the product of s and the touches' mean likelihoods, in nats; 0 before any touch.
  double log_evidence() const;
  /// Standard error of log_evidence() in nats.
  double standard_error() const;

 private:
  /// The bins over which a touch's mean is.
  struct Overlap {
    std::vector<OverlapPlane> planes;  ///< [object, theta]
    std::int64_t bins = 0;
    double weighted_bins = 0.0;  ///< by prior weight
    bool everywhere = false;     ///< whether all bins count, wherever the array is
  };
  /// A run of bins of a tile.
  struct Draw {
    BinBox bins;             ///< of one row
    double log_scale = 0.0;  ///< log of one over (bins in the run * bound)
  };
  /// The sum of a touch's likelihood over bins, by prior weight.
  struct WeightedSum {
    double log_sum = 0.0;
    double squared_error = 0.0;  ///< of log_sum
  };

  Overlap overlap_of(const ArrayRectangle& array) const;
  const OverlapPlane& plane(const Overlap& overlap, const BinBox& box) const;
  /// The bins of a box's only row that count.
  BinBox counted(const Overlap& overlap, const BinBox& row) const;
  WeightedSum sum_of_all(const Overlap& overlap, const KnownElements& elements) const;
  WeightedSum sum_by_draws(const Overlap& overlap, const KnownElements& elements,
                           std::uint64_t seed) const;
  std::vector<TouchTile> tiles_of(const Overlap& overlap, const KnownElements& elements) const;
  std::vector<Draw> draws_from(std::span<const TouchTile> tiles, std::uint64_t seed) const;
  /// Log of the summed likelihood of each box of one row; -infinity where none of its bins counts.
  std::vector<double> log_sums(std::span<const BinBox> rows, const Overlap& overlap,
                               const KnownElements& elements) const;

  std::vector<BoundingBox> boxes_;  ///< around each object's occupied cells
  PoseLattice lattice_;
  std::vector<glm::dvec2> turns_;  ///< [theta] cosine and sine
  std::vector<double> log_weight_;
  const BinLikelihood& likelihood_;
  std::span<const TileBounds> bounds_;
  std::vector<TouchMean> means_;
};

}  // namespace palpate
