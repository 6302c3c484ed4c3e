#pragma once

#include <cstddef>
#include <vector>

#include "bounding_box.hpp"
#include "palpate/occupancy_grid.hpp"
#include "reading_gains.hpp"

namespace palpate {

/// A map read at the nodes of a lattice that is turned about the object frame's origin: node (x, y)
/// lies at R(theta) step (x, y). Holds, for each level of reading, the sums of gains along rows.
class TurnedMap {
 public:
  /// @param reach in nodes, how far to the left and right of the map's nodes sums are asked for
  TurnedMap(const OccupancyGrid& compared, const ReadingGains& gains, double step_mm,
            double theta_rad, int reach);

  int first_row() const { return y_; }
  int last_row() const { return y_ + ny_ - 1; }
  /// Columns at which sums may be asked for.
  int first_column() const { return x_; }
  int last_column() const { return x_ + nx_; }
  /// The sums along a row: entry x minus entry x' is the gain of nodes [x', x). The first entry is
  /// first_column()'s, the last one last_column()'s.
  const float* row(std::size_t level, int y) const {
    return sums_.data() +
           (level * static_cast<std::size_t>(ny_) + static_cast<std::size_t>(y - y_)) *
               static_cast<std::size_t>(nx_ + 1);
  }

 private:
  int x_ = 0;
  int y_ = 0;
  int nx_ = 0;
  int ny_ = 0;
  std::vector<float> sums_;  ///< [level, ny, nx + 1]
};

}  // namespace palpate
