#pragma once

#include <span>
#include <string>

#include "palpate/learned_sensor.hpp"

namespace palpate {

/// The features of a press of an object.
struct LabelledFeatures {
  std::string label;
  PressFeatures features;
};

/// The distribution of each object's features. An object's standard deviations are drawn towards
/// those of all presses about the means of their objects, as if four presses more had varied so:
/// sd^2 = (n sd_object^2 + 4 sd_pooled^2) / (n + 4) * (1 + 1 / n), where the last factor is what
/// the mean of n presses misses. Where every object has one press, all presses' standard deviation
/// stands for the pooled one. `any` has the mean and standard deviation of all presses. No
/// deviation is below 0.05. The weight is left at 0.
/// @throws Error on no press
LearnedFeatures learn_features(std::span<const LabelledFeatures> presses);

}  // namespace palpate
