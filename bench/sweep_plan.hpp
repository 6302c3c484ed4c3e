#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "palpate/lattice.hpp"
#include "sweep.hpp"

namespace palpate::bench {

/// Bins along x, y and theta.
using BinCounts = std::array<int, 3>;
std::int64_t product(const BinCounts& bins);
PoseLattice lattice_with(const BinCounts& bins);

/// The goal's lattice: balanced, about a million bins.
inline constexpr BinCounts goal_bins = {64, 64, 244};
inline constexpr double goal_cell_mm = 0.5;

/// Cells of one size and the lattices to try with their maps.
struct CellPlan {
  double cell_mm = 0.0;
  std::vector<BinCounts> lattices;  ///< by rising count
  std::vector<int> particles;
  std::vector<BinCounts> compared;  ///< with the baselines
};

/// What is measured, in this order.
struct SweepPlan {
  int trials_each = 0;  ///< for every letter
  // Bins per object, but for the goal's lattice, up to which every trial is in full, and two of
  // every letter; beyond, one.
  std::int64_t most_full = 0;
  std::int64_t most_twice = 0;
  std::vector<CellPlan> cells;
  std::vector<BinCounts> limits;  ///< their lattices
  int limit_trials_each = 0;

  /// Trials of every letter with the full posterior, at most trials_each.
  int full_each(double cell_mm, const BinCounts& bins) const;
  /// Trials of every letter for this many particles.
  int particle_trials_each(int particles) const;
};

/// Counts in the proportions of the goal's lattice and, for cells of 0.5 mm, the paper's Table I.
SweepPlan plan_of(const SweepOptions& options);

/// One of the proportions of the goal's lattice, not of Table I.
bool is_balanced(const BinCounts& bins);

}  // namespace palpate::bench
