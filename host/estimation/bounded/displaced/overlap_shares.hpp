#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/displaced/displacement_weights.hpp"
#include "estimation/touch_overlap.hpp"
#include "model/bounding_box.hpp"

namespace palpate {

/// What a displaced touch's exact likelihoods P count in the sum of its averaged ones over the
/// overlapping bins, O:
///   sum over x in O of sum over x' of W(x, x') P(x') = sum over x' of k(x') P(x'),
///   k(x') = sum over x in O of W(x, x').
/// So the mean needs no average: k, the share of x', is 1 well within O and the region, and 0 far
/// from O. The shares of all bins add up to the number of bins in O.
class OverlapShares {
 public:
  /// From bin x on, the bins of a row count so much more than those before it.
  struct Step {
    int x = 0;
    double more = 0.0;
  };
  /// 1 over the sum of each bin's weights inside the region, at the bins of O at one theta.
  struct Plane {
    int y_first = 0;
    std::vector<std::vector<Step>> rows;
  };
  /// Planes that were looked at, by theta; of one object.
  using Planes = std::map<int, Plane>;
  /// The shares of a box's bins, [y, x], each within `error`.
  struct Shares {
    std::vector<double> of_bins;
    double error = 0.0;
  };

  /// Finds O's bins. On the threads of the caller's arena.
  /// @param weights outlive this object, as do the objects
  /// @param objects boxes around their occupied cells
  /// @param everywhere all bins overlap
  OverlapShares(const DisplacementWeights& weights, const ArrayRectangle& array,
                const glm::dvec2& sensor_from_pivot_mm, std::span<const BoundingBox> objects,
                bool everywhere);

  /// Number of O's bins in a plane.
  std::int64_t overlapping(std::size_t object, int theta) const {
    return extent_of(object, theta).bins;
  }
  /// A box around the bins of a plane that have a share; of no bin where there are none.
  BinBox reach(std::size_t object, int theta) const;
  /// No bin of the plane has a larger share.
  double most(std::size_t object, int theta) const;
  Shares at(const BinBox& box, Planes& of_object) const;
  /// Bound of the relative error of all shares, in nats, beside Shares::error.
  double relative_error() const;

 private:
  /// A tap of the means at a theta.
  struct Taken {
    int from = 0;           ///< the means' theta
    std::size_t index = 0;  ///< of that theta's taps
  };
  /// O's bins at one theta.
  struct Extent {
    std::int64_t bins = 0;
    BinBox box;                ///< around them
    double most_weight = 0.0;  ///< 1 over the least sum of a bin's weights inside the region
    bool inside = true;        ///< all of their weights lie inside the region
  };

  /// The rows of O at one theta, [y].
  std::vector<OverlapPlane::Bins> rows(std::size_t object, int theta) const;
  Extent extent(std::size_t object, int theta) const;
  Plane plane(const Extent& extent) const;
  const Extent& extent_of(std::size_t object, int theta) const {
    return extents_[object * taps_.size() + static_cast<std::size_t>(theta)];
  }

  const DisplacementWeights& weights_;
  ArrayRectangle array_;
  std::span<const BoundingBox> objects_;
  bool everywhere_;
  double fraction_error_;
  AxisBlur x_;
  AxisBlur y_;
  std::vector<std::vector<Tap>> taps_;     ///< [theta] that a mean there takes
  std::vector<std::vector<Taken>> taken_;  ///< [theta] those that take likelihoods there
  std::vector<Extent> extents_;            ///< [object, theta]
};

}  // namespace palpate
