#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "estimation/bin_box.hpp"
#include "palpate/estimate.hpp"

namespace palpate {

/// Adds up the probabilities of a lattice's bins on a grid; a bin counts in the grid's nearest bin.
class MarginalSums {
 public:
  /// Takes the time of the bins that are added where the grid turns about another pivot, and else
  /// less: boxes of one likelihood take that of the grid's bins.
  /// @param lattice,grid checked
  MarginalSums(const PoseLattice& lattice, const PoseLattice& grid);

  /// @param log_likelihood of the box's bins, [y, x], or one for all
  /// @param log_offset what makes a log-likelihood the log of a probability
  void add(const BinBox& box, std::span<const double> log_likelihood, double log_offset);

  Marginals take() { return std::move(sums_); }

 private:
  void add_one_by_one(const BinBox& box, std::span<const double> log_likelihood, double log_offset);

  PoseLattice lattice_;
  Marginals sums_;
  bool same_pivot_;
  std::vector<std::int32_t> column_;  ///< [lattice x] of the grid, where the pivots are the same
  std::vector<std::int32_t> row_;     ///< [lattice y]
  std::vector<std::int32_t> theta_;   ///< [lattice theta]
};

}  // namespace palpate
