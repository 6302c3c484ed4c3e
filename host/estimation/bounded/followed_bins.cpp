#include "estimation/bounded/followed_bins.hpp"

#include <cmath>

namespace palpate {

FollowedBins::FollowedBins(const EvaluatedBins& bins, const SearchResult& found,
                           std::span<const double> log_weight)
    : log_weight_(log_weight.begin(), log_weight.end()) {
  std::vector<LogSum> outside(log_weight.size());
  for (std::size_t i = 0; i < outside.size(); ++i) {
    outside[i].add(found.mass[i].dropped);
  }
  bins.visit([&](const BinBox& box, std::span<const double> log_likelihood) {
    if (static_cast<std::int64_t>(log_likelihood.size()) == box.bins()) {
      boxes_.push_back(box);
      values_.insert(values_.end(), log_likelihood.begin(), log_likelihood.end());
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
  std::vector<double> added(values_.size());
  likelihood.evaluate(boxes_, elements, std::span(added));
  for (std::size_t i = 0; i < values_.size(); ++i) {
    values_[i] += added[i];
  }
  for (std::size_t i = 0; i < outside_.size(); ++i) {
    outside_[i] += most[i];
  }
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

void FollowedBins::visit(const BinVisitor& visit) const {
  std::size_t first = 0;
  for (const BinBox& box : boxes_) {
    const auto bins = static_cast<std::size_t>(box.bins());
    visit(box, std::span(values_).subspan(first, bins));
    first += bins;
  }
}

}  // namespace palpate
