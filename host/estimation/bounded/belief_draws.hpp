#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/search/rejection_draws.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// Draws bins from a belief whose bins come box by box, one in each of equal parts of the belief.
class BeliefDraws {
 public:
  /// @param targets ascending, as parts of the belief
  /// @param lattice,log_weight outlive this object; log_weight is [hypothesis], the log of its
  /// prior weight
  /// @param log_total log of the summed likelihood of all bins to come, with prior weights
  BeliefDraws(std::vector<double> targets, const PoseLattice& lattice,
              std::span<const double> log_weight, double log_total)
      : lattice_(lattice),
        log_weight_(log_weight),
        log_total_(log_total),
        targets_(std::move(targets)) {
    draws_.reserve(targets_.size());
  }

  /// See BinVisitor.
  void add(const BinBox& box, std::span<const double> log_likelihood) {
    const bool alike = log_likelihood.size() == 1;
    for (std::size_t i = 0; i < log_likelihood.size(); ++i) {
      const std::int64_t bins = alike ? box.bins() : 1;
      const double p = std::exp(log_weight_[box.object] - log_total_ + log_likelihood[i]);
      const double after = reached_ + p * static_cast<double>(bins);
      last_ = {box.object, box.bin(static_cast<std::int64_t>(i) + bins - 1, lattice_)};
      while (draws_.size() < targets_.size() && targets_[draws_.size()] < after) {
        const auto within = static_cast<std::int64_t>((targets_[draws_.size()] - reached_) / p);
        const std::int64_t bin = static_cast<std::int64_t>(i) + std::min(within, bins - 1);
        draws_.push_back({box.object, box.bin(bin, lattice_)});
      }
      reached_ = after;
    }
  }

  /// The draws, in the order of objects and bins.
  std::vector<DrawnBin> take() {
    draws_.resize(targets_.size(), last_);  // rounding may leave the last draw out
    std::ranges::sort(draws_, {}, &DrawnBin::place);
    return std::move(draws_);
  }

 private:
  const PoseLattice& lattice_;
  std::span<const double> log_weight_;
  double log_total_;
  std::vector<double> targets_;  ///< ascending, as parts of the belief
  std::vector<DrawnBin> draws_;
  double reached_ = 0.0;  ///< part of the belief that has come
  DrawnBin last_;         ///< the last bin that has come
};

}  // namespace palpate
