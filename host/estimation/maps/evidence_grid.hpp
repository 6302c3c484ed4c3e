#pragma once

#include <span>
#include <vector>

#include "gpu/command_stream.hpp"
#include "model/cell_range.hpp"
#include "palpate/contact.hpp"
#include "palpate/sensor_model.hpp"

namespace palpate {

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
