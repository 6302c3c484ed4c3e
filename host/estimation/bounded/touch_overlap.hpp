#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "model/bounding_box.hpp"
#include "palpate/lattice.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// The rectangle around a touch's elements, parallel to the sensor's axes. Lengths in mm.
struct ArrayRectangle {
  glm::dvec2 from_pivot_mm{};  ///< of its centre, in the robot frame
  glm::dvec2 half_mm{};        ///< half its sides
  double direction_rad = 0.0;  ///< of the sensor's x axis, in the robot frame
};

ArrayRectangle array_rectangle(const Touch& touch, const glm::dvec2& pivot_mm);

/// The bins of one theta at which the array overlaps an object: at which its rectangle meets the
/// box around the object's cells, as OverlapMean and reference::overlaps() have it. Whether two
/// rectangles meet is decided by their shadows on the four axes of both, and each shadow bounds x
/// in a row of bins from both sides: the overlapping bins of a row are neighbours.
class OverlapPlane {
 public:
  /// Neighbouring bins of a row.
  struct Bins {
    int first = 0;
    int count = 0;
  };

  /// @param object around the object's occupied cells, in the object frame
  OverlapPlane(const ArrayRectangle& array, const BoundingBox& object, const PoseLattice& lattice,
               int theta);

  /// The overlapping bins of any row.
  Bins row(int y) const;
  /// Number of overlapping bins.
  std::int64_t bins() const;
  /// False only where none of the bins of these rows and columns overlaps.
  bool may_overlap(const Bins& x, const Bins& y) const;

 private:
  /// The centres of an axis's bins.
  struct Line {
    explicit Line(const Axis& axis);
    double centre(int i) const { return first_mm + i * step_mm; }
    Bins within(double low_mm, double high_mm) const;

    double first_mm;
    double step_mm;
    double per_mm;  ///< 1 / step_mm
    int last;       ///< bin
  };

  Line x_mm_;
  Line y_mm_;
  glm::dvec2 apart_mm_{};         ///< from the object's middle to the array's, at x = y = 0
  glm::dvec2 reach_mm_{};         ///< of |apart| along the object's axes
  glm::dvec2 turned_reach_mm_{};  ///< of |apart| along the array's axes
  double cos_ = 1.0;              ///< of the array's direction in the object frame
  double sin_ = 0.0;
  double per_cos_ = 1.0;  ///< 1 / cos_
  double per_sin_ = 0.0;
  Bins rows_;  ///< that may hold overlapping bins, as the columns
  Bins columns_;
};

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
