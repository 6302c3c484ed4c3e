#pragma once

#include <span>
#include <string>
#include <vector>

#include "learning/press.hpp"
#include "palpate/learned_sensor.hpp"

namespace palpate {

/// The features of a press of an object.
struct LabelledFeatures {
  std::string label;
  PressFeatures features;
};

/// The distribution of each object's features. An object's covariance is drawn towards that of all
/// presses about the means of their objects, as if four presses more had varied so:
/// C = (n C_object + 4 C_pooled) / (n + 4) * (1 + 1 / n) + 0.05^2 I, where the factor is what the
/// mean of n presses misses, and the last term keeps presses that were all alike from being
/// demanded alike. Where every object has one press, all presses' covariance stands for the pooled
/// one. `any` has the mean and covariance of all presses. The weight stays 0.
/// @param presses at least one
LearnedFeatures learn_features(std::span<const LabelledFeatures> presses);
/// The distributions of presses' features, each press by its first touch.
LearnedFeatures learn_features(const std::vector<Press>& presses,
                               const ContactClassifier& classifier);

}  // namespace palpate
