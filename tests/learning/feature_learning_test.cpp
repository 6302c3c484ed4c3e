#include "feature_learning.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"

namespace palpate {
namespace {

LabelledFeatures press(const char* label, double value) {
  return {label, {{value, 2.0 * value, 7.0}}};
}

TEST(FeatureLearning, DrawsDeviationsTowardsThePooledOnes) {
  const std::vector<LabelledFeatures> presses{press("A", 1.0), press("A", 3.0), press("B", 10.0),
                                              press("B", 16.0)};
  const LearnedFeatures learned = learn_features(presses);
  // Squared differences: A 2, B 18; pooled 20 / 2. Shrunk: (2 + 4 * 10) / 6 and (18 + 40) / 6.
  EXPECT_DOUBLE_EQ(learned.objects.at("A").mean[0], 2.0);
  EXPECT_NEAR(learned.objects.at("A").sd[0], std::sqrt(42.0 / 6.0 * 1.5), 1e-9);
  EXPECT_NEAR(learned.objects.at("B").sd[0], std::sqrt(58.0 / 6.0 * 1.5), 1e-9);
  EXPECT_NEAR(learned.objects.at("B").sd[1], 2.0 * learned.objects.at("B").sd[0], 1e-9);
  EXPECT_DOUBLE_EQ(learned.objects.at("A").sd[2], 0.05) << "the least deviation";
  EXPECT_DOUBLE_EQ(learned.any.mean[0], 7.5);
  EXPECT_NEAR(learned.any.sd[0], std::sqrt(141.0 / 3.0), 1e-9);
  EXPECT_EQ(learned.weight, 0.0);
}

TEST(FeatureLearning, OfOnePressEachTakesAllPresses) {
  const std::vector<LabelledFeatures> presses{press("A", 1.0), press("B", 5.0)};
  const LearnedFeatures learned = learn_features(presses);
  // The variance of both is 8; (0 + 4 * 8) / 5 * 2.
  EXPECT_NEAR(learned.objects.at("A").sd[0], std::sqrt(12.8), 1e-9);
}

TEST(FeatureLearning, OfOnePressIsFinite) {
  const LearnedFeatures learned = learn_features(std::vector{press("A", 1.0)});
  EXPECT_DOUBLE_EQ(learned.objects.at("A").sd[0], 0.05);
  EXPECT_DOUBLE_EQ(learned.any.sd[0], 0.05);
  EXPECT_THROW(learn_features({}), Error);
}

}  // namespace
}  // namespace palpate
