// What the error of readings makes of a belief that displaced touches and slips widen, too.

#include "recognition/scaled_pose.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::scaled_pose_test {

// Of n touches, each of which tells the place with a variance, the belief has an n-th of that.
TEST(ScaledPose, ExactTouchesScaleAsTheirReadingsDo) {
  for (const int touches : {1, 3, 9}) {
    EXPECT_DOUBLE_EQ(belief_factor(0.4, 0.1, {.touches = touches}), 0.4);
  }
}

TEST(ScaledPose, WhatDisplacementAddsStays) {
  constexpr double readings_mm2 = 0.3;
  constexpr double displacement_mm2 = 1.2;
  constexpr double factor = 0.4;
  for (const int touches : {1, 3, 9}) {
    const double before = (readings_mm2 + displacement_mm2) / touches;
    const double after = (factor * readings_mm2 + displacement_mm2) / touches;
    EXPECT_NEAR(
        belief_factor(factor, before, {.displacement_mm2 = displacement_mm2, .touches = touches}),
        after / before, 1e-9);
  }
}

TEST(ScaledPose, ABeliefNoWiderThanDisplacementMakesItStays) {
  EXPECT_EQ(belief_factor(0.4, 0.1, {.displacement_mm2 = 1.0, .touches = 9}), 1.0);
  EXPECT_EQ(belief_factor(2.5, 0.1, {.displacement_mm2 = 1.0, .touches = 9}), 1.0);
}

// Where an object slips, a belief settles where a touch tells as much as a slip forgets:
// p^2 = c s for readings of a variance c far above that of a slip, s.
TEST(ScaledPose, ASlippingBeliefGrowsAsTheRootOfItsReadings) {
  constexpr double slip_mm2 = 1e-4;
  constexpr double readings_mm2 = 1.0;
  EXPECT_NEAR(belief_factor(0.25, std::sqrt(slip_mm2 * readings_mm2),
                            {.slip_mm2 = slip_mm2, .touches = 10'000}),
              0.5, 0.01);
}

}  // namespace palpate::scaled_pose_test
