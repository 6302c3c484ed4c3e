#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "command_stream.hpp"
#include "palpate/contact.hpp"
#include "palpate/sensor_model.hpp"

namespace palpate {

/// Cells [x, x + nx) x [y, y + ny), where cell (i, j) is centred at cell_mm * (i, j).
struct CellRange {
  std::int64_t x = 0;
  std::int64_t y = 0;
  std::int64_t nx = 0;
  std::int64_t ny = 0;

  bool contains(const CellRange& other) const;
};

/// The smallest range that holds both; an empty one holds nothing.
CellRange united(const CellRange& a, const CellRange& b);
/// The cells that both hold, of which there is at least one.
CellRange common(const CellRange& a, const CellRange& b);

/// Cells whose centres lie within `margin_mm` of the rectangle, which reaches no further than
/// `farthest_mm`.
/// @throws Error where they are more than 2^30
CellRange cover(const glm::dvec2& lowest_mm, const glm::dvec2& highest_mm, double margin_mm,
                double cell_mm);

/// Log-odds increments of readings, summed per cell on the device (Eq. 4-6) in two floats, so that
/// the sum stays exact to float32 however many readings there are. It grows with what is added.
class EvidenceGrid {
 public:
  EvidenceGrid(gpu::Context& context, double cell_mm, const InverseSensorModel& sensor);

  /// Throws Error where the device cannot hold these cells.
  void require_room(const CellRange& range) const;
  bool has_room(const CellRange& range) const;
  /// Adds readings, each to the cells within the radius and some beyond. Runs on the device in
  /// passes of bounded memory.
  void add(std::span<const ElementReading> readings, double radius_mm);
  /// The sums over the cells of a range, row by row; 0 where nothing was added.
  std::vector<double> sums(const CellRange& range);
  /// Back to no evidence and no cells.
  void clear();

 private:
  void grow(const CellRange& needed);

  gpu::Context& context_;
  gpu::CommandStream stream_;
  double cell_mm_;
  InverseSensorModel sensor_;
  gpu::Kernel kernel_;
  CellRange needed_;   ///< so far
  CellRange range_;    ///< the same and some room
  gpu::Buffer cells_;  ///< of range_, [ny, nx], two floats
};

}  // namespace palpate
