#include "recognition/evaluation.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace palpate::proportion_test {

TEST(WilsonInterval, HasThePublishedEnds) {
  // Newcombe 1998, table I: 81 of 263 and 0 of 20, to four digits.
  EXPECT_NEAR(wilson_interval(81, 263).low, 0.2553, 5e-5);
  EXPECT_NEAR(wilson_interval(81, 263).high, 0.3662, 5e-5);
  EXPECT_EQ(wilson_interval(0, 20).low, 0.0);
  EXPECT_NEAR(wilson_interval(0, 20).high, 0.1611, 5e-5);
  EXPECT_EQ(wilson_interval(20, 20).high, 1.0);
}

TEST(ToldApart, CountsPairsAndHalfOfTies) {
  const std::vector higher{0.9, 0.4, 0.8};
  const std::vector lower{0.5, 0.4};
  // 0.9 and 0.8 exceed both, 0.4 is a tie with 0.4 and below 0.5.
  EXPECT_DOUBLE_EQ(told_apart(lower, higher), 4.5 / 6.0);
  EXPECT_DOUBLE_EQ(told_apart(higher, lower), 1.5 / 6.0);
  EXPECT_DOUBLE_EQ(told_apart(std::vector{0.0}, higher), 1.0);
}

TEST(ToldApart, HasTheErrorOfHanleyAndMcNeil) {
  // Area 0.75, two and three values: Q1 = 0.75 / 1.25 = 0.6, Q2 = 2 * 0.5625 / 1.75 = 0.642857;
  // (0.1875 + 2 * 0.0375 + 1 * 0.080357) / 6 = 0.0571429.
  EXPECT_NEAR(told_apart_error(0.75, 2, 3), std::sqrt(0.0571429), 1e-6);
  // Their example of 58 normal and 51 abnormal images, with an area of 0.893.
  EXPECT_NEAR(told_apart_error(0.893, 58, 51), 0.0325, 5e-5);
  EXPECT_EQ(told_apart_error(1.0, 4, 5), 0.0);
  EXPECT_EQ(told_apart_error(0.0, 4, 5), 0.0);
  EXPECT_NEAR(told_apart_error(0.5, 1, 1), 0.5, 1e-12);
}

}  // namespace palpate::proportion_test
