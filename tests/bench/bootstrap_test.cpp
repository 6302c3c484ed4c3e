#include "bootstrap.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "model/random.hpp"

namespace palpate::bench::bootstrap_test {

std::vector<double> normal_values(int count, double centre, std::uint64_t seed) {
  Random random(seed, Stream::touch_order);
  std::vector<double> values;
  for (int i = 0; i < count; ++i) {
    values.push_back(centre + random.normal());
  }
  return values;
}

TEST(Bootstrap, OfAMeanAgreesWithStudentsInterval) {
  const std::vector<double> values = normal_values(200, 5.0, 3);
  const Interval interval = bootstrap_mean_interval(values);
  const Interval student = mean_interval(values);
  // The half width is 0.14; percentiles of 2,000 samples are known to some 0.005, and the
  // bootstrap's deviation is smaller by a factor of sqrt(199 / 200).
  EXPECT_NEAR(interval.low, student.low, 0.015);
  EXPECT_NEAR(interval.high, student.high, 0.015);
}

TEST(Bootstrap, OfPairsProfitsFromThePairing) {
  const std::vector<double> denominators = normal_values(100, 5.0, 4);
  std::vector<double> numerators;
  for (const double value : denominators) {
    numerators.push_back(0.8 * value);
  }
  const Interval interval = bootstrap_ratio_interval(numerators, denominators);
  // Every sample has this ratio, to the rounding of sums of 100 values.
  EXPECT_NEAR(interval.low, 0.8, 1e-12);
  EXPECT_NEAR(interval.high, 0.8, 1e-12);
}

TEST(Bootstrap, GivesTheSameIntervalAgain) {
  const std::vector<double> values = normal_values(20, 0.0, 5);
  EXPECT_EQ(bootstrap_mean_interval(values).low, bootstrap_mean_interval(values).low);
  EXPECT_EQ(bootstrap_mean_interval(std::vector{2.0}).high, 2.0);
}

TEST(ToldApart, CountsPairsAndHalvesTies) {
  const std::vector<double> lower = {0.5, -3.5};
  const std::vector<double> higher = {1.0, 0.0, -3.5};
  EXPECT_DOUBLE_EQ(told_apart(lower, higher), (1.0 + 2.0 + 0.5) / 6.0);
  EXPECT_DOUBLE_EQ(told_apart(higher, lower), 1.0 - 3.5 / 6.0);
}

}  // namespace palpate::bench::bootstrap_test
