#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "leaf_evaluator.hpp"

namespace palpate {

/// Keeps the bins that a search evaluated, as far as there is room for them.
class EvaluatedBins {
 public:
  void clear();
  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood);
  /// False where there was no room for all.
  bool complete() const { return complete_; }
  void visit(const BinVisitor& visit) const;

  std::uint64_t bytes() const {
    return boxes_.capacity() * sizeof(BinBox) + values_.capacity() * sizeof(double) +
           value_counts_.capacity() * sizeof(std::uint32_t);
  }

 private:
  std::vector<BinBox> boxes_;
  std::vector<std::uint32_t> value_counts_;  ///< [box]
  std::vector<double> values_;
  bool complete_ = true;
};

}  // namespace palpate
