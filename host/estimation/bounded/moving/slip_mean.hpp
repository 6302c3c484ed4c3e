#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/displaced/displacement_weights.hpp"
#include "estimation/bounded/displaced/places.hpp"

namespace palpate {

template <typename Domain>
struct BlurredPlane;

/// Averages one object's belief over where the object may have slipped to: each theta is blurred
/// along y and then along x, and neighbouring thetas are added up at g + R(alpha) (t - g). Weights
/// outside the region are left out, and the others divided by their sum. A place is a bin or, for
/// upper bounds, a tile of bins; all arrays of places are [theta, y, x].
class SlipMean {
 public:
  /// @param weights of the slip; outlive this object
  /// @param centroid_mm g, in the object's frame
  /// @param bins of a place along each axis
  SlipMean(const DisplacementWeights& weights, const glm::dvec2& centroid_mm, int bins);

  int columns() const { return static_cast<int>(x_.scale.size()); }
  int rows() const { return static_cast<int>(y_.scale.size()); }

  /// Upper bounds of the means at the bins of all tiles.
  /// @param log_bounds of the belief in every tile, in nats
  std::vector<double> bounds(std::span<const double> log_bounds) const;
  /// Means at the bins of some blocks.
  /// @param targets sorted by theta, y, x
  /// @param log_belief of all bins, in nats
  /// @param log_mean of the targets' bins; others keep what they hold
  /// @param error the same: a mean may be wrong by e^error - 1 of itself, beside mean_error(),
  /// since the places to which turns move a bin are rounded
  /// @param by_logs also where a mean lies so far below its surroundings that float64 does not hold
  /// it
  /// @returns log of what float64 does not hold at any bin; its log_mean is -infinity then
  double means(std::span<const BlockRun> targets, std::span<const double> log_belief,
               std::span<double> log_mean, std::span<double> error, bool by_logs) const;
  /// Bound of the error of means(), in nats.
  double mean_error() const;
  /// What all bins together have of a bin's belief after the slip, [theta, y, x], or [y, x] where
  /// theta covers the circle: 1 away from the region's ends. Within kept_error().
  std::vector<double> kept() const;
  /// Bound of the error of kept(), in nats.
  double kept_error() const { return mean_error() + 64.0 * fraction_error_; }

 private:
  /// Where a bin's belief comes from as theta grows by some steps, in bins from the bin, by the
  /// bin's distance from the centroid in mm.
  struct Turn {
    glm::dvec2 x{0.0};
    glm::dvec2 y{0.0};
  };
  /// The tiles [first, end) that a tile's bins come from by a turn, and the least weight of these
  /// that lies inside the region for any of the bins.
  struct TileSource {
    int x_first = 0;
    int x_end = 0;
    int y_first = 0;
    int y_end = 0;
    double inside = 0.0;
  };
  std::size_t index_of(const Tap& tap) const {
    return static_cast<std::size_t>(std::ptrdiff_t{tap.steps} + weights_.theta_steps());
  }
  const Turn& turn(const Tap& tap) const { return turns_[index_of(tap)]; }
  void find_sources();
  TileSource source_of(int px, int py, const Turn& turned) const;
  /// The box around the places, in bins, that the bins [first, last] come from.
  struct PlaceBox {
    glm::dvec2 least;
    glm::dvec2 most;
  };
  PlaceBox moved(const Turn& turn, const glm::ivec2& first, const glm::ivec2& last) const;
  BlockRange blocks_taken(const Turn& turn, const BlockRun& run) const;
  template <typename Domain, typename Value>
  std::vector<BlurredPlane<Domain>> blurred(std::span<const BlockRun> targets,
                                            std::span<const Value> logs) const;
  template <typename Domain>
  bool sum_turns(std::span<const BlockRun> targets, std::span<const double> log_belief,
                 std::span<double> log_mean, std::span<double> error, double& lost) const;

  const DisplacementWeights& weights_;
  int bins_;
  AxisBlur x_;
  AxisBlur y_;
  glm::dvec2 first_mm_;                           ///< the first bin from the centroid
  glm::dvec2 step_mm_;                            ///< 0 along an axis of one bin
  std::vector<Turn> turns_;                       ///< [steps of theta, from the least]
  std::vector<std::vector<Tap>> taps_;            ///< [theta]
  std::vector<std::vector<TileSource>> sources_;  ///< [steps of theta][tile]; of tiles alone
  double fraction_error_;
};

}  // namespace palpate
