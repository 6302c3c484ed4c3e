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

/// Neighbouring bins of a row.
struct RowBins {
  int first = 0;
  int count = 0;
};

/// Finds the bins of one theta at which the array overlaps an object: at which its rectangle meets
/// the box around the object's cells, as OverlapMean and reference::overlaps() have it. Whether two
/// rectangles meet is decided by their shadows on the four axes of both, and each shadow bounds x
/// in a row of bins from both sides: the overlapping bins of a row are neighbours.
/// @param object around the object's occupied cells, in the object frame
/// @param rows out: the overlapping bins of every row, [y]
void find_overlap(const ArrayRectangle& array, const BoundingBox& object,
                  const PoseLattice& lattice, int theta, std::span<RowBins> rows);

/// Counts the bins of a plane's rows, [y], and widens a box of no bin to hold them.
std::int64_t count_bins(std::span<const RowBins> rows, BinBox& around);

}  // namespace palpate
