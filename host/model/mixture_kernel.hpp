#pragma once

#include <cstddef>
#include <span>

namespace palpate {

/// Lists of hypotheses that the functions below read and write are padded to a multiple of this.
inline constexpr std::size_t mixture_lanes = 8;

/// Sums rows of numbers: sums[h] = rows[0][h] + rows[1][h] + ..., in this order.
/// @param rows [row][hypothesis], padded
/// @param sums [hypothesis], padded
void sum_rows(std::span<const double* const> rows, std::span<double> sums);

/// log of the sum of exp(v). Within 1e-13 of itself, plus 2^-1021 of it for every v.
/// @param values padded with -infinity
double log_sum_exp(std::span<const double> values);

/// What hypotheses say about one element.
struct ElementPrediction {
  const double* log_likelihood;  ///< [level, hypothesis], padded, in nats
  double* probability;  ///< [level, hypothesis], padded; out: P(level) / sum of all levels'
  std::size_t levels;
};

/// Finds the probability of every reading of an element, and adds the mean and the variance of its
/// log-likelihood under these probabilities to those of the touch.
/// @param mean,variance [hypothesis], padded
void predict_element(const ElementPrediction& element, std::span<double> mean,
                     std::span<double> variance);

}  // namespace palpate
