#pragma once

#include <cstdint>
#include <span>

#include "estimation/bin_box.hpp"
#include "model/bounding_box.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// The rectangle around a touch's elements, parallel to the sensor's axes. Lengths in mm.
struct ArrayRectangle {
  glm::dvec2 from_pivot_mm{};  ///< of its centre, in the robot frame
  glm::dvec2 half_mm{};        ///< half its sides
  double direction_rad = 0.0;  ///< of the sensor's x axis, in the robot frame
};

/// @param elements_mm in the sensor frame
ArrayRectangle array_rectangle(const Pose& T_robot_sensor, std::span<const glm::dvec2> elements_mm,
                               const glm::dvec2& pivot_mm);

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

  /// Finds the overlapping bins of every row, [y].
  void find_rows(std::span<Bins> of_row) const;

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
  Bins rows_;  ///< that may hold overlapping bins
};

/// Counts the bins of a plane's rows, [y], and widens a box of no bin to hold them.
std::int64_t count_bins(std::span<const OverlapPlane::Bins> rows, BinBox& around);

}  // namespace palpate
