#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/array_overlap.hpp"
#include "estimation/bounded/bin_box.hpp"
#include "model/bounding_box.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// The bins at which a touch's array overlaps the objects: those over which "none of these" takes
/// the mean of the touch's likelihood.
class TouchOverlap {
 public:
  /// @param boxes [object] around its occupied cells
  TouchOverlap(const ArrayRectangle& array, std::span<const BoundingBox> boxes,
               const PoseLattice& lattice);

  /// The number of such bins, each object's times its weight.
  /// @param log_weight [object]
  double weighted_bins(std::span<const double> log_weight) const;
  /// False only where the array overlaps the object at none of a box's bins.
  bool may_hold(const BinBox& box) const;
  /// The smallest box that holds all such bins of a box; of no bin where there are none.
  BinBox cut(const BinBox& box) const;
  /// Number of such bins in a box.
  std::int64_t bins(const BinBox& box) const;
  /// Sets the values, [y, x], of a box's other bins to the least finite value of their type.
  template <typename Value>
  void leave_out_others(const BinBox& box, Value* values) const;

 private:
  const OverlapPlane& plane(const BinBox& box) const {
    return planes_[static_cast<std::size_t>(box.object) * static_cast<std::size_t>(thetas_) +
                   static_cast<std::size_t>(box.theta)];
  }

  int thetas_;
  std::vector<OverlapPlane> planes_;  ///< [object, theta]
};

}  // namespace palpate
