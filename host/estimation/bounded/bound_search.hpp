#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bin_likelihood.hpp"
#include "known_elements.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// Bins whose log-likelihood a search evaluated.
struct EvaluatedBins {
  std::vector<BinBox> boxes;           ///< ascending by object, theta, y, x
  std::vector<double> log_likelihood;  ///< boxes one after another, [y, x] in each, in nats

  std::uint64_t bytes() const {
    return boxes.capacity() * sizeof(BinBox) + log_likelihood.capacity() * sizeof(double);
  }
};

/// What a search found out about one hypothesis, as logs in nats with its prior weight.
struct HypothesisEvidence {
  double log_evaluated = 0.0;  ///< of the summed likelihood of the bins that were evaluated
  double log_rounding = 0.0;   ///< of the bound of that sum's error
  double log_dropped = 0.0;    ///< of the bound of the summed likelihood of all other bins
};

/// What a search by bounds returns.
struct SearchResult {
  std::vector<HypothesisEvidence> evidence;  ///< [hypothesis]
  int best_object = 0;
  std::int64_t best_bin = 0;
  double best_log_likelihood = 0.0;  ///< of the best bin, without prior weights
  bool mode_certain = false;
  std::int64_t blocks_bounded = 0;
  std::int64_t bins_evaluated = 0;
  EvaluatedBins bins;
};

}  // namespace palpate
