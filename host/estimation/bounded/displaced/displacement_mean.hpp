#pragma once

#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/displaced/places.hpp"
#include "estimation/displacement_weights.hpp"

namespace palpate {

/// Averages a touch's likelihoods over where its sensor may have been, at the places that are asked
/// for. Each theta is blurred along y and then along x; then neighbouring thetas are added up at
/// the places to which the turns move a bin. From upper bounds of the likelihoods of tiles, this
/// gives upper bounds of the means. Both are logs, [run, block, y, x], in nats; -infinity where a
/// place holds no bin.
struct DisplacementMean {
  /// @param place_bins bins of a place along each axis: those of a tile for bounds(), 1 for means()
  DisplacementMean(const DisplacementWeights& weights, int place_bins);

  /// Bounds for tiles, in float32 arithmetic and rounded up.
  /// @param targets sorted by theta, y, x
  std::vector<double> bounds(const glm::dvec2& sensor_from_pivot_mm,
                             std::span<const BlockRun> targets,
                             const PlaceSource<float>& source) const;
  /// Means of bins, in float64 arithmetic.
  std::vector<double> means(const glm::dvec2& sensor_from_pivot_mm,
                            std::span<const BlockRun> targets,
                            const PlaceSource<double>& source) const;
  /// Bound of the error of means(), in nats, beside the source's own.
  double mean_error() const;

  DisplacementWeights touch;
  int bins;  ///< of a place along each axis
  AxisBlur x;
  AxisBlur y;
};

}  // namespace palpate
