#include "estimation/bounded/evaluated_bins.hpp"

namespace palpate {

void EvaluatedBins::add(const BinBox& box, std::span<const double> log_likelihood) {
  if (!complete_) {
    return;
  }
  if (!keeps_all_ && bytes_used() + sizeof(BinBox) + sizeof(std::uint32_t) +
                             log_likelihood.size() * sizeof(double) >
                         most_bytes) {
    clear();
    complete_ = false;
    return;
  }
  boxes_.push_back(box);
  value_counts_.push_back(static_cast<std::uint32_t>(log_likelihood.size()));
  values_.insert(values_.end(), log_likelihood.begin(), log_likelihood.end());
}

void EvaluatedBins::visit(const BinVisitor& visit) const {
  std::size_t first = 0;
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    visit(boxes_[i], std::span(values_).subspan(first, value_counts_[i]));
    first += value_counts_[i];
  }
}

}  // namespace palpate
