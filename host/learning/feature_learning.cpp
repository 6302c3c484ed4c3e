#include "feature_learning.hpp"

#include <algorithm>
#include <cmath>

#include "palpate/error.hpp"

namespace palpate {

namespace {

using Values = std::array<double, PressFeatures::count>;

constexpr double least_sd = 0.05;  // of logarithms: 5 %
constexpr double pseudo_presses = 4.0;

struct Moments {
  double n = 0.0;
  Values sum{};
  Values squares{};

  void add(const PressFeatures& features) {
    n += 1.0;
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += features.values[i];
      squares[i] += features.values[i] * features.values[i];
    }
  }
  double mean(std::size_t i) const { return sum[i] / n; }
  /// Sum of squared differences from the mean.
  double scatter(std::size_t i) const { return std::max(0.0, squares[i] - sum[i] * sum[i] / n); }
};

}  // namespace

LearnedFeatures learn_features(std::span<const LabelledFeatures> presses) {
  if (presses.empty()) {
    throw Error(Fault::input, "press features: no presses; give at least one");
  }
  Moments all;
  std::map<std::string, Moments> objects;
  for (const LabelledFeatures& press : presses) {
    all.add(press.features);
    objects[press.label].add(press.features);
  }
  LearnedFeatures learned;
  Values pooled{};
  const double freedoms = all.n - static_cast<double>(objects.size());
  for (std::size_t i = 0; i < pooled.size(); ++i) {
    const double variance = all.scatter(i) / std::max(1.0, all.n - 1.0);
    double within = 0.0;
    for (const auto& [label, own] : objects) {
      within += own.scatter(i);
    }
    pooled[i] = freedoms > 0.0 ? within / freedoms : variance;
    learned.any.mean[i] = all.mean(i);
    learned.any.sd[i] = std::max(least_sd, std::sqrt(variance));
  }
  for (const auto& [label, own] : objects) {
    FeatureDistribution& distribution = learned.objects[label];
    for (std::size_t i = 0; i < pooled.size(); ++i) {
      const double shrunk =
          (own.scatter(i) + pseudo_presses * pooled[i]) / (own.n + pseudo_presses);
      distribution.mean[i] = own.mean(i);
      distribution.sd[i] = std::max(least_sd, std::sqrt(shrunk * (1.0 + 1.0 / own.n)));
    }
  }
  return learned;
}

}  // namespace palpate
