#include "estimation/bounded/evaluated_bins.hpp"

#include <cmath>

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

FollowedBins::FollowedBins(const EvaluatedBins& bins, const SearchResult& found,
                           std::span<const double> log_weight, std::size_t touches)
    : log_weight_(log_weight.begin(), log_weight.end()), touches_(touches) {
  std::vector<LogSum> outside(log_weight.size());
  for (std::size_t i = 0; i < outside.size(); ++i) {
    outside[i].add(found.mass[i].dropped);
  }
  bins.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    if (static_cast<std::int64_t>(log_likelihood.size()) == box.bins()) {
      bins_.add(box, log_likelihood);
    } else {
      // Bins that saw the prior alone: too many to follow.
      outside[box.object].add(log_weight_[box.object] + log_likelihood[0] +
                              std::log(static_cast<double>(box.bins())));
    }
  });
  for (const LogSum& of : outside) {
    outside_.push_back(of.log());
  }
  add_up();
}

void FollowedBins::add(const KnownElements& elements, const BinLikelihood& likelihood,
                       std::span<const double> most) {
  const std::span<double> values = bins_.values();
  std::vector<double> added(values.size());
  likelihood.evaluate(bins_.boxes(), elements,
                      likelihood.displaced() ? Arithmetic::float32 : Arithmetic::float64, added);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] += added[i];
  }
  for (std::size_t i = 0; i < outside_.size(); ++i) {
    outside_[i] += most[i];
  }
  ++touches_;
  add_up();
}

double FollowedBins::share_outside() const {
  LogSum outside;
  for (const double of : outside_) {
    outside.add(of);
  }
  return std::exp(outside.log() - log_total());
}

void FollowedBins::add_up() {
  LogSum total;
  visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    for (const double l : log_likelihood) {
      total.add(log_weight_[box.object] + l);
    }
  });
  log_total_ = total.log();
}

}  // namespace palpate
