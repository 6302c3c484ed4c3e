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
  /// Index of cell (i, j) in row-major order.
  std::size_t index(std::int64_t i, std::int64_t j) const {
    return static_cast<std::size_t>((j - y) * nx + i - x);
  }
};

/// Returns the smallest range that holds both; an empty range adds nothing.
CellRange united(const CellRange& a, const CellRange& b);
/// Returns the cells that both hold; nx or ny is at most 0 where there are none.
CellRange common(const CellRange& a, const CellRange& b);

/// Returns the cells whose centres lie within `margin_mm` of the rectangle, whose corners must lie
/// within `farthest_mm`.
/// @throws Error where these are more than most_cells
CellRange cover(const glm::dvec2& lowest_mm, const glm::dvec2& highest_mm, double margin_mm,
                double cell_mm);

/// Sums the log-odds increments of readings per cell on the device (Eq. 4-6), in two floats, so
/// that each sum is exact to float32 for any number of readings. The grid grows with the readings.
class EvidenceGrid {
 public:
  EvidenceGrid(gpu::Context& context, double cell_mm, const InverseSensorModel& sensor);

  /// Throws Error where the device cannot hold these cells.
  void require_room(const CellRange& range) const;
  bool has_room(const CellRange& range) const;
  /// Adds each reading to the cells within `radius_mm` of it and to some beyond, in passes of
  /// bounded device memory.
  void add(std::span<const ElementReading> readings, double radius_mm);
  /// Returns the sums over the cells of a range, in row-major order; 0 where nothing was added.
  std::vector<double> sums(const CellRange& range);
  /// Removes all evidence and all cells.
  void clear();

 private:
  void grow(const CellRange& needed);

  gpu::Context& context_;
  gpu::CommandStream stream_;
  double cell_mm_;
  InverseSensorModel sensor_;
  gpu::Kernel kernel_;
  CellRange needed_;   ///< cells that the readings so far need
  CellRange range_;    ///< needed_ and room to grow
  gpu::Buffer cells_;  ///< of range_, [ny, nx], two floats
};

}  // namespace palpate
