#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/mass_account.hpp"

namespace palpate {

/// Evaluates the bins of boxes, the leaves of a search: all in float32, and those that hold most of
/// the mass once more in float64, so that rounding stays within its part of the tolerance.
class LeafEvaluator {
 public:
  LeafEvaluator(const BinLikelihood& likelihood, std::span<const double> log_weight,
                const SearchGoal& goal, const KnownElements& elements, const BinVisitor& visit,
                const Deadline& deadline, MassAccount& account);

  /// Evaluates the bins of boxes that are sorted by place. They are settled by a later flush().
  void add(std::vector<BinBox> boxes);
  /// Evaluates the bins of a box only to learn how likely its best one is.
  void look(const BinBox& box);
  /// Settles all bins that were added.
  void flush() { settle(1.0); }
  std::int64_t bins() const { return bins_; }

 private:
  struct Leaf {
    BinBox box;
    std::size_t first = 0;  ///< of its values
    double log_mass = 0.0;  ///< without the prior weight
    double largest = 0.0;
  };

  /// Sums the values of the leaves' bins that count.
  template <typename Value>
  void sum_up(std::span<Leaf> leaves, Value* values) const;
  void evaluate_exactly(std::span<Leaf> leaves, std::span<double> values) const;
  /// Indices of the pending leaves that must be evaluated in float64: the heaviest.
  std::vector<std::size_t> to_be_refined(double share) const;
  /// @param share of the rounding that is left to be used up
  void settle(double share);
  void settle(const Leaf& leaf, std::span<const double> values, double error);

  const BinLikelihood& likelihood_;
  std::span<const double> log_weight_;
  const SearchGoal& goal_;
  const KnownElements& elements_;
  const BinVisitor& visit_;
  const Deadline& deadline_;
  MassAccount& account_;
  std::vector<double> float32_error_;  ///< [hypothesis]
  std::vector<double> float64_error_;
  double least_error_ = 0.0;  ///< that evaluating all in float64 would leave
  std::vector<Leaf> pending_;
  std::vector<float> values_;         ///< of the pending leaves
  std::vector<LogSum> pending_mass_;  ///< [hypothesis] lower bounds, with the prior weight
  std::int64_t bins_ = 0;
};

}  // namespace palpate
