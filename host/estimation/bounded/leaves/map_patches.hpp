#pragma once

#include <cstdint>
#include <vector>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A map's log odds for the kernels of bins: bordered by `border` nodes of the prior on every side,
/// and stored so that the 16 floats from patch(x, y) on are the nodes of columns x to x + 3 and
/// rows y to y + 3 of the bordered map, column by column. Every node is stored four times.
class MapPatches {
 public:
  static constexpr int border = 4;
  static constexpr int side = 4;  ///< of a patch, in nodes

  /// @throws Error where the bordered map has more nodes than kernels can index
  MapPatches(const OccupancyGrid& map, double prior);

  int width() const { return width_; }
  int height() const { return height_; }
  /// [y, x, row of the patch]; longer by what a vector may read beyond the last patch.
  const float* nodes() const { return nodes_.data(); }
  std::uint64_t bytes() const { return nodes_.capacity() * sizeof(float); }

  /// The number that stands for the prior in nodes(): a float near it that no cell of the map
  /// holds, so that float64 kernels can put the exact prior in its place.
  float marker() const { return marker_; }
  double prior_log_odds() const { return prior_log_odds_; }

 private:
  int width_;
  int height_;
  double prior_log_odds_;
  float marker_;
  std::vector<float> nodes_;
};

}  // namespace palpate
