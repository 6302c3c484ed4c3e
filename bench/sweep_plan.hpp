#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "commands.hpp"
#include "palpate/lattice.hpp"

namespace palpate::bench {

/// Bins along x, y and theta.
using BinCounts = std::array<int, 3>;
std::int64_t product(const BinCounts& bins);
PoseLattice lattice_with(const BinCounts& bins);

/// The goal's lattice: balanced, about a million bins.
inline constexpr BinCounts goal_bins = {64, 64, 244};
inline constexpr double goal_cell_mm = 0.5;

inline constexpr int touches_per_trial = 15;
inline constexpr std::uint64_t trial_seed = 1'000;  ///< the experiment's

/// What is run on maps of one cell size.
struct CellPlan {
  double cell_mm = 0.0;
  std::vector<BinCounts> lattices = {};  ///< by rising count
  std::vector<int> particles = {};
  std::vector<BinCounts> compared = {};  ///< lattices for compare_paths()
  std::vector<BinCounts> bounded = {};   ///< lattices for measure_bounds(), by rising count
};

/// What is measured, in this order.
struct SweepPlan {
  int trials_each = 0;          ///< for every letter
  std::int64_t most_full = 0;   ///< bins per object up to which all trials get the full posterior
  std::int64_t most_twice = 0;  ///< the same for two trials of every letter; beyond, one trial does
  std::vector<CellPlan> cells;
  std::vector<BinCounts> limits;  ///< lattices of measure_limits()
  int limit_trials_each = 0;
  bool quick = false;  ///< two of the limits' variants

  /// Trials of every letter that get the full posterior: all of them on the goal's lattice.
  int full_each(double cell_mm, const BinCounts& bins) const;
  /// Trials of every letter for measure_bounds().
  int bounded_each(const BinCounts& bins) const;
  /// Trials of every letter for this many particles.
  int particle_trials_each(int particles) const;
};

/// Lattices in the proportions of the goal's and, for cells of 0.5 mm, those of the paper's Table
/// I.
SweepPlan plan_of(const SweepOptions& options);

/// Whether the lattice has the proportions of the goal's, and is none of Table I.
bool is_balanced(const BinCounts& bins);

}  // namespace palpate::bench
