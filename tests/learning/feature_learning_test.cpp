#include "learning/feature_learning.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"

namespace palpate::feature_learning_test {

LabelledFeatures press(const char* label, double value) {
  return {label, {{value, 2.0 * value, 7.0}}};
}

/// With what keeps like presses from being demanded alike.
double sd(double variance) { return std::sqrt(variance + 0.05 * 0.05); }

TEST(FeatureLearning, DrawsDeviationsTowardsThePooledOnes) {
  const std::vector<LabelledFeatures> presses{press("A", 1.0), press("A", 3.0), press("B", 10.0),
                                              press("B", 16.0)};
  const LearnedFeatures learned = learn_features(presses);
  // Squared differences: A 2, B 18; pooled 20 / 2. Shrunk: (2 + 4 * 10) / 6 and (18 + 40) / 6.
  EXPECT_DOUBLE_EQ(learned.objects.at("A").mean[0], 2.0);
  EXPECT_NEAR(learned.objects.at("A").sd[0], sd(42.0 / 6.0 * 1.5), 1e-9);
  EXPECT_NEAR(learned.objects.at("B").sd[0], sd(58.0 / 6.0 * 1.5), 1e-9);
  EXPECT_NEAR(learned.objects.at("B").sd[1], sd(4.0 * 58.0 / 6.0 * 1.5), 1e-9);
  EXPECT_DOUBLE_EQ(learned.objects.at("A").sd[2], 0.05) << "the least deviation";
  EXPECT_DOUBLE_EQ(learned.any.mean[0], 7.5);
  EXPECT_NEAR(learned.any.sd[0], sd(141.0 / 3.0), 1e-9);
  EXPECT_EQ(learned.weight, 0.0);
}

TEST(FeatureLearning, NoCorrelationIsSoHighThatRoundingInAFileBreaksIt) {
  const std::vector<LabelledFeatures> presses{press("A", 1.0), press("A", 1e6)};
  EXPECT_NEAR(learn_features(presses).any.correlation[0], 0.999, 1e-6);
}

TEST(FeatureLearning, FeaturesThatGoTogetherAreExpectedToGoTogether) {
  // The force is the area's double or so, and the peak goes its own way.
  const std::vector<LabelledFeatures> presses{{"A", {{1.0, 2.1, 5.0}}}, {"A", {{2.0, 3.9, 5.2}}},
                                              {"A", {{3.0, 6.1, 5.2}}}, {"A", {{4.0, 7.9, 5.0}}},
                                              {"B", {{1.0, 1.0, 1.0}}}, {"B", {{1.0, 1.0, 1.0}}}};
  const FeatureDistribution learned = learn_features(presses).objects.at("A");
  EXPECT_GT(learned.correlation[0], 0.9);
  EXPECT_LT(learned.correlation[0], 1.0);
  EXPECT_NEAR(learned.correlation[1], 0.0, 0.05);
  // Both are an sd from the mean in area; one has the force of its area.
  const double apart = learned.sd[0];
  const double fits = learned.log_density({{2.5 + apart, 5.0 + 2.0 * apart, 5.1}});
  const double does_not = learned.log_density({{2.5 + apart, 5.0 - 2.0 * apart, 5.1}});
  EXPECT_GT(fits, does_not + 5.0);
}

TEST(FeatureLearning, DensityIsThatOfTheCovariance) {
  FeatureDistribution distribution{
      .mean = {1.0, 2.0, 3.0}, .sd = {0.5, 2.0, 1.0}, .correlation = {0.6, -0.3, 0.2}};
  // -z^T C^-1 z / 2 - log sqrt((2 pi)^3 det C), C by hand: see the inverse's cofactors.
  const double det = 1.0 + 2.0 * 0.6 * -0.3 * 0.2 - 0.36 - 0.09 - 0.04;
  const double z[3] = {1.0, -0.5, 2.0};
  const double cofactor[3][3] = {{1.0 - 0.04, -0.3 * 0.2 - 0.6, 0.6 * 0.2 + 0.3},
                                 {-0.3 * 0.2 - 0.6, 1.0 - 0.09, -0.3 * 0.6 - 0.2},
                                 {0.6 * 0.2 + 0.3, -0.3 * 0.6 - 0.2, 1.0 - 0.36}};
  double expected = -1.5 * std::log(2.0 * std::numbers::pi) - 0.5 * std::log(det);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      expected -= 0.5 * z[i] * cofactor[i][j] / det * z[j];
    }
  }
  EXPECT_NEAR(distribution.log_density({{1.5, 1.0, 5.0}}), expected, 1e-12);  // sd multiply to 1
  distribution.correlation = {0.9, 0.9, -0.9};
  EXPECT_TRUE(std::isnan(distribution.log_density({{1.5, 1.0, 5.0}})));
}

TEST(FeatureLearning, OfOnePressEachTakesAllPresses) {
  const std::vector<LabelledFeatures> presses{press("A", 1.0), press("B", 5.0)};
  const LearnedFeatures learned = learn_features(presses);
  // The variance of both is 8; (0 + 4 * 8) / 5 * 2.
  EXPECT_NEAR(learned.objects.at("A").sd[0], sd(12.8), 1e-9);
}

TEST(FeatureLearning, OfOnePressIsFinite) {
  const LearnedFeatures learned = learn_features(std::vector{press("A", 1.0)});
  EXPECT_DOUBLE_EQ(learned.objects.at("A").sd[0], 0.05);
  EXPECT_DOUBLE_EQ(learned.any.sd[0], 0.05);
}

}  // namespace palpate::feature_learning_test
