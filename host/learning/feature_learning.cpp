#include "learning/feature_learning.hpp"

#include <algorithm>

#include <glm/exponential.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>

namespace palpate {

namespace {

constexpr double least_sd = 0.05;  ///< least deviation of a logarithm, 5 % of the feature
constexpr double pseudo_presses = 4.0;
/// The largest correlation. Numbers rounded in a file still make a distribution below it.
constexpr double most_correlated = 0.999;

/// The products of the differences from a mean, summed over presses.
struct Scatter {
  double n = 0.0;
  glm::dvec3 mean{0.0};
  glm::dmat3 products{0.0};

  /// Welford's update, which keeps its digits where presses are nearly alike.
  void add(const PressFeatures& features) {
    const auto [area, force, peak] = features.values;
    const glm::dvec3 values(area, force, peak);
    const glm::dvec3 before = values - mean;
    n += 1.0;
    mean += before / n;
    products += glm::outerProduct(before, values - mean);
  }
};

FeatureDistribution distribution_of(const glm::dvec3& mean, const glm::dmat3& covariance) {
  const glm::dvec3 variance(covariance[0][0], covariance[1][1], covariance[2][2]);
  const glm::dvec3 sd = glm::sqrt(variance + least_sd * least_sd);
  const auto correlation = [&](int i, int j) {
    return most_correlated * covariance[i][j] / (sd[i] * sd[j]);
  };
  return {.mean = {mean.x, mean.y, mean.z},
          .sd = {sd.x, sd.y, sd.z},
          .correlation = {correlation(0, 1), correlation(0, 2), correlation(1, 2)}};
}

}  // namespace

LearnedFeatures learn_features(std::span<const LabelledFeatures> presses) {
  Scatter all;
  std::map<std::string, Scatter> objects;
  for (const LabelledFeatures& press : presses) {
    all.add(press.features);
    objects[press.label].add(press.features);
  }
  const glm::dmat3 of_all = all.products / std::max(1.0, all.n - 1.0);
  const double freedoms = all.n - static_cast<double>(objects.size());
  glm::dmat3 pooled = of_all;
  if (freedoms > 0.0) {
    pooled = glm::dmat3(0.0);
    for (const auto& [label, own] : objects) {
      pooled += own.products / freedoms;
    }
  }
  LearnedFeatures learned{.any = distribution_of(all.mean, of_all)};
  for (const auto& [label, own] : objects) {
    const double share = (1.0 + 1.0 / own.n) / (own.n + pseudo_presses);
    learned.objects[label] =
        distribution_of(own.mean, share * (own.products + pseudo_presses * pooled));
  }
  return learned;
}

LearnedFeatures learn_features(const std::vector<Press>& presses,
                               const ContactClassifier& classifier) {
  std::vector<LabelledFeatures> features;
  for (const Press& press : presses) {
    features.push_back({press.label, press_features(press.touches.front(), classifier)});
  }
  return learn_features(features);
}

}  // namespace palpate
