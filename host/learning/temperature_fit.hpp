#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "learning/held_out.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate {

/// See LearnedSensor::temperature.
struct TemperatureFit {
  double temperature = 1.0;
  double feature_weight = 0.0;
  double growth = 0.0;

  double temperature_after(std::size_t touches) const {
    return temperature_of(touches, temperature, growth);
  }
};
/// The temperature of at least 0.01, and the weight in [0, 2] of the features where presses have
/// them, of the least log-loss. Besides the presses, one more counts, of two labels whose log
/// evidences differ by the median margin of the presses (label against the best other): it is
/// right or wrong with equal weights, so that presses which are all told apart, however clearly, do
/// not make the temperature 0. For the features a further such press counts, whose log densities
/// differ by their median margin.
///   The evidence has at least the say that it has alone: features lower the temperature, but do
/// not raise it. Where they tell all presses apart, the log-loss would leave the evidence none, and
/// a day of lighter presses would be taken for other objects.
///   The weight is 0 unless what the other folds show helps each fold's presses, all together: the
/// presses of a fold were made at another time than the others, see folds_of().
///   The growth has the least log-loss of the groups; it is 0 unless what each half of them
/// shows helps the other half, both taken together.
/// @param all presses of one touch each, with a log evidence for each of the same labels, finite
/// for their own, and groups
/// @throws Error on no press, and where no press has two labels to choose from
TemperatureFit fit_temperature(std::span<const HeldOut> all);

/// The presses and groups with the logarithms of their labels' probabilities in the place of the
/// evidences. The presses and groups of a fold have the numbers of the other folds' presses, or of
/// all where none of these has two labels to choose from; the groups have the growth of the other
/// half.
/// @throws Error as fit_temperature()
std::vector<HeldOut> tempered_by_folds(std::span<const HeldOut> all);

}  // namespace palpate
