#include "recognition/marginal_grid.hpp"

#include <algorithm>

namespace palpate {

namespace {

constexpr int most_bins = 400;
constexpr int most_angles = 360;

Axis coarser(const Axis& axis) {
  const int width = (axis.count - 1) / most_bins + 1;  // in bins of the axis
  const int count = (axis.count - 1) / width + 1;
  Axis wide{axis.lower, axis.lower + axis.step() * width * count, count};
  if (count * width == axis.count || wide.upper > farthest_mm) {
    wide.upper = axis.upper;
  }
  return wide;
}

}  // namespace

PoseLattice marginal_grid(const PoseLattice& lattice) {
  PoseLattice grid = lattice;
  grid.x_mm = coarser(lattice.x_mm);
  grid.y_mm = coarser(lattice.y_mm);
  // Not beyond the range, which may be a full circle.
  grid.theta_rad.count = std::min(lattice.theta_rad.count, most_angles);
  return grid;
}

}  // namespace palpate
