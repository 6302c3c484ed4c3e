#pragma once

#include <optional>
#include <span>
#include <vector>

#include "learning/cross_validation.hpp"
#include "learning/temperature_fit.hpp"

namespace palpate {

/// What recognition gains by a learned sensor over Eq. 7 on touches that neither has seen.
struct SensorGain {
  double log_loss_before = 0.0;  ///< of single touches by Eq. 7 with gamma 0.1, in nats
  double log_loss = 0.0;         ///< of single touches by the table and the temperature
  LossDifference less_loss;      ///< of single touches, in nats
  /// Geometric means of the pose errors of CrossValidation::groups; none where there are no groups.
  std::optional<double> error_mm_before;  ///< by Eq. 7
  std::optional<double> error_mm;         ///< by the table
  LossDifference less_error;              ///< of the errors' logarithms, where there are groups
  /// Either the loss or the error is less beyond chance, and neither is more beyond chance by over
  /// 0.02 nats, or a tenth of the error: touches that are all told apart have next to no loss, with
  /// a temperature a little more.
  bool better = false;
  bool gains = false;  ///< the first of both
};

/// @param after the presses of `table` with the temperature
SensorGain gain_of(const CrossValidation& eq7, const CrossValidation& table,
                   std::span<const ScoredPress> after);

/// The losses of presses with their labels' log probabilities, in nats.
std::vector<double> losses_of(std::span<const ScoredPress> presses);

}  // namespace palpate
