#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"

namespace palpate {

/// Keeps the bins that a search evaluated, as far as there is room for them.
class EvaluatedBins {
 public:
  /// @param keeps_all also beyond its room: the search ends soon after full()
  explicit EvaluatedBins(bool keeps_all = false) : keeps_all_(keeps_all) {}

  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood) {
    if (!complete_) {
      return;
    }
    values_.insert(values_.end(), log_likelihood.begin(), log_likelihood.end());
    boxes_.push_back({box, values_.size()});
    if (full() && !keeps_all_) {
      *this = EvaluatedBins();
      complete_ = false;
    }
  }
  /// False where there was no room for all.
  bool complete() const { return complete_; }
  /// There is no room for more.
  bool full() const {
    return boxes_.size() * sizeof(Box) + values_.size() * sizeof(double) > most_bytes;
  }
  void visit(const BinVisitor& visit) const {
    std::size_t first = 0;
    for (const Box& box : boxes_) {
      visit(box.bins, std::span(values_).subspan(first, box.values_end - first));
      first = box.values_end;
    }
  }
  std::uint64_t bytes() const {
    return boxes_.capacity() * sizeof(Box) + values_.capacity() * sizeof(double);
  }

 private:
  struct Box {
    BinBox bins;
    std::size_t values_end = 0;  ///< in values_
  };
  /// Together with the vectors' growth within some 160 MiB.
  static constexpr std::uint64_t most_bytes = std::uint64_t{80} << 20;

  bool keeps_all_;
  std::vector<Box> boxes_;
  std::vector<double> values_;
  bool complete_ = true;
};

}  // namespace palpate
