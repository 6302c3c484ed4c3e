#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "recognition/belief_modes.hpp"

namespace palpate {

/// x, y and theta.
std::array<const Axis*, 3> axes_of(const PoseLattice& lattice);

/// Indices of a bin along x, y and theta.
using AxisIndices = std::array<int, 3>;
AxisIndices indices_of(const PoseLattice& lattice, std::int64_t bin);

/// (x_mm, y_mm, theta_rad) of a lattice.
using LatticePlace = std::array<double, 3>;
/// A refined pose on the lattice, with the turn of theta that is nearest to the region's middle.
LatticePlace place_of(const RefinedPose& refined, const PoseLattice& lattice);
/// Variances of that place.
LatticePlace variances_of(const RefinedPose& refined, const PoseLattice& lattice);

/// An object's belief in cells of some bins each, about a millimetre wide by how far they move the
/// object, and the peaks that the cells belong to.
class BeliefCells {
 public:
  static constexpr int outside = -2;  ///< in the place of a peak: the cell is of none

  /// @param bins,at the bins and their indices
  BeliefCells(const BinnedObject& of, std::span<const BinShare> bins,
              std::span<const AxisIndices> at);

  /// Gives every cell its peak, from the densest cell down: that of its densest neighbour. Joins
  /// peaks with a higher one where they hardly stand above the saddle between them; leaves cells
  /// far below their peak out. See find_modes().
  void climb();

  std::size_t peaks() const { return peaks_.size(); }
  /// The peak of a bin's cell after climb(), below peaks(), or `outside`.
  int peak_of(const AxisIndices& bin);

 private:
  struct Peak {
    double density = 0.0;
    int parent = 0;  ///< the higher peak that this one is part of, or itself
  };
  using Neighbours = std::array<std::size_t, 26>;

  std::size_t cell_of(const AxisIndices& bin) const;
  /// The number of bins that a cell holds: fewer at the end of an axis.
  double bins_in(std::size_t cell) const;
  /// Writes the neighbours that have a label; returns how many there are.
  std::size_t neighbours(std::size_t cell, Neighbours& near) const;
  int root(int peak);
  /// Makes the lower of two peaks part of the higher where it hardly stands above their saddle.
  void join(int a, int b, double saddle);

  const PoseLattice& lattice_;
  AxisIndices every_{};  ///< bins of a cell
  AxisIndices first_{};  ///< cell
  AxisIndices count_{};
  std::vector<double> density_;    ///< [theta, y, x] mean share of a cell's bins
  std::vector<std::size_t> seen_;  ///< cells that have bins
  std::vector<int> label_;         ///< [theta, y, x] a peak, `outside`, or none yet
  std::vector<Peak> peaks_;
};

}  // namespace palpate
