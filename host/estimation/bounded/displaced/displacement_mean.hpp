#pragma once

#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/displaced/displacement_weights.hpp"
#include "estimation/bounded/displaced/places.hpp"

namespace palpate {

/// A touch's log-likelihoods averaged over where its sensor may have been, [run, block, y, x].
struct DisplacedMeans {
  std::vector<double> log_mean;  ///< in nats; -infinity where a place holds no bin
  /// A bin's mean may be wrong by e^error - 1 of itself, since the places to which turns move the
  /// bin are rounded.
  std::vector<double> error;
};

/// The weights of displacements between places.
struct PlaceWeights {
  const DisplacementWeights& touch;
  int bins;  ///< of a place along each axis
  AxisBlur x;
  AxisBlur y;
};

/// Averages a touch's likelihoods over where its sensor may have been, at the places that are asked
/// for. Each theta is blurred along y and then along x; then neighbouring thetas are added up at
/// the places to which the turns move a bin. From upper bounds of the likelihoods of tiles, this
/// gives upper bounds of the means.
class DisplacementMean {
 public:
  /// @param weights outlive this object
  /// @param bins of a place along each axis
  DisplacementMean(const DisplacementWeights& weights, int bins);

  /// Bounds for tiles, in float32 arithmetic and rounded up.
  /// @param targets sorted by theta, y, x
  std::vector<double> bounds(const glm::dvec2& sensor_from_pivot_mm,
                             std::span<const BlockRun> targets,
                             const PlaceSource<float>& source) const;
  /// Means of bins, in float64 arithmetic.
  DisplacedMeans means(const glm::dvec2& sensor_from_pivot_mm, std::span<const BlockRun> targets,
                       const PlaceSource<double>& source) const;
  /// Bound of the error of means(), in nats, beside DisplacedMeans::error and the source's own.
  double mean_error() const;

 private:
  PlaceWeights weights_;
};

}  // namespace palpate
