#pragma once

#include <optional>
#include <span>
#include <vector>

#include "learning/temperature_fit.hpp"

namespace palpate {

/// What recognition gains by a learned sensor over Eq. 7 on touches that neither has seen.
struct SensorGain {
  double log_loss_before = 0.0;  ///< of single touches by Eq. 7 with gamma 0.1, in nats
  double log_loss = 0.0;         ///< of single touches by the table and the temperature
  LossDifference less_loss;      ///< of single touches, in nats
  /// Geometric means of HeldOut::error_mm; none where there are no groups.
  std::optional<double> error_mm_before;  ///< by Eq. 7
  std::optional<double> error_mm;         ///< by the table
  LossDifference less_error;              ///< of the errors' logarithms, where there are groups
  /// Either the loss or the error is less beyond chance, and neither is more beyond chance by over
  /// 0.02 nats, or a tenth of the error: touches that are all told apart have next to no loss, with
  /// a temperature a little more.
  bool better = false;
  bool gains = false;  ///< the first of both
};

/// @param eq7 what Eq. 7 says, with gamma 0.1
/// @param tempered what the table says, see tempered_by_folds()
SensorGain gain_of(std::span<const HeldOut> eq7, std::span<const HeldOut> tempered);

/// The losses of presses alone with their labels' log probabilities, in nats.
std::vector<double> losses_of(std::span<const HeldOut> all);

}  // namespace palpate
