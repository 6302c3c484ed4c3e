#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/search/search_goal.hpp"

namespace palpate {

/// Keeps the bins that a search evaluated, as far as there is room for them.
class EvaluatedBins {
 public:
  /// @param keeps_all also beyond its room: the search ends soon after full()
  explicit EvaluatedBins(bool keeps_all = false) : keeps_all_(keeps_all) {}
  void clear() { *this = EvaluatedBins(keeps_all_); }
  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood);
  /// False where there was no room for all.
  bool complete() const { return complete_; }
  /// There is no room for more.
  bool full() const { return bytes_used() > most_bytes; }
  void visit(const BinVisitor& visit) const;

  std::uint64_t bytes() const {
    return boxes_.capacity() * sizeof(BinBox) + values_.capacity() * sizeof(double) +
           value_counts_.capacity() * sizeof(std::uint32_t);
  }

 private:
  /// Together with the vectors' growth within some 160 MiB.
  static constexpr std::uint64_t most_bytes = std::uint64_t{80} << 20;

  std::uint64_t bytes_used() const {
    return boxes_.size() * (sizeof(BinBox) + sizeof(std::uint32_t)) +
           values_.size() * sizeof(double);
  }

  bool keeps_all_;
  std::vector<BinBox> boxes_;
  std::vector<std::uint32_t> value_counts_;  ///< [box]
  std::vector<double> values_;
  bool complete_ = true;
};

}  // namespace palpate
