#include "learning/feature_learning.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace palpate {

namespace {

using Values = std::array<double, PressFeatures::count>;
using Matrix = std::array<Values, PressFeatures::count>;

constexpr double least_sd = 0.05;  ///< least deviation of a logarithm, 5 % of the feature
constexpr double pseudo_presses = 4.0;
/// The largest correlation. Numbers rounded in a file still make a distribution below it.
constexpr double most_correlated = 0.999;

/// The products of the differences from a mean, summed over presses.
struct Scatter {
  double n = 0.0;
  Values mean{};
  Matrix products{};

  /// Welford's update, which keeps its digits where presses are nearly alike.
  void add(const PressFeatures& features) {
    n += 1.0;
    Values before{};
    for (std::size_t i = 0; i < mean.size(); ++i) {
      before[i] = features.values[i] - mean[i];
      mean[i] += before[i] / n;
    }
    for (std::size_t i = 0; i < mean.size(); ++i) {
      for (std::size_t j = 0; j < mean.size(); ++j) {
        products[i][j] += before[i] * (features.values[j] - mean[j]);
      }
    }
  }
};

/// a A + b B.
Matrix combined(double a, const Matrix& of_a, double b, const Matrix& of_b) {
  Matrix sum{};
  for (std::size_t i = 0; i < sum.size(); ++i) {
    for (std::size_t j = 0; j < sum.size(); ++j) {
      sum[i][j] = a * of_a[i][j] + b * of_b[i][j];
    }
  }
  return sum;
}

FeatureDistribution distribution_of(const Values& mean, const Matrix& covariance) {
  FeatureDistribution distribution{.mean = mean};
  for (std::size_t i = 0; i < mean.size(); ++i) {
    distribution.sd[i] = std::sqrt(covariance[i][i] + least_sd * least_sd);
  }
  std::size_t pair = 0;
  for (std::size_t i = 0; i < mean.size(); ++i) {
    for (std::size_t j = i + 1; j < mean.size(); ++j) {
      distribution.correlation[pair++] =
          most_correlated * covariance[i][j] / (distribution.sd[i] * distribution.sd[j]);
    }
  }
  return distribution;
}

}  // namespace

LearnedFeatures learn_features(std::span<const LabelledFeatures> presses) {
  Scatter all;
  std::map<std::string, Scatter> objects;
  for (const LabelledFeatures& press : presses) {
    all.add(press.features);
    objects[press.label].add(press.features);
  }
  const Matrix none{};
  const Matrix of_all = combined(1.0 / std::max(1.0, all.n - 1.0), all.products, 0.0, none);
  const double freedoms = all.n - static_cast<double>(objects.size());
  Matrix pooled = of_all;
  if (freedoms > 0.0) {
    pooled = none;
    for (const auto& [label, own] : objects) {
      pooled = combined(1.0, pooled, 1.0 / freedoms, own.products);
    }
  }
  LearnedFeatures learned{.any = distribution_of(all.mean, of_all)};
  for (const auto& [label, own] : objects) {
    const double share = (1.0 + 1.0 / own.n) / (own.n + pseudo_presses);
    learned.objects[label] =
        distribution_of(own.mean, combined(share, own.products, share * pseudo_presses, pooled));
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
