#include "learning/tried_bins.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "simulated_presses.hpp"
#include "support/synthetic.hpp"

namespace palpate::drawn_poses_test {

/// Where an element lies in the object frame.
glm::dvec2 place_of(const Press& press, std::size_t touch, std::size_t element) {
  const Touch& of = press.touches[touch];
  return *press.T_object_robot * (of.T_robot_sensor * of.elements_mm[element]);
}

void expect_same_places(const Press& press, const Press& moved) {
  ASSERT_EQ(press.touches.size(), moved.touches.size());
  for (std::size_t touch = 0; touch < press.touches.size(); ++touch) {
    for (const std::size_t element : {std::size_t{0}, std::size_t{7}, std::size_t{35}}) {
      const glm::dvec2 apart = place_of(press, touch, element) - place_of(moved, touch, element);
      EXPECT_NEAR(std::hypot(apart.x, apart.y), 0.0, 1e-10);
      EXPECT_EQ(press.touches[touch].pressure[element], moved.touches[touch].pressure[element]);
    }
  }
}

class DrawnPoses : public ::testing::Test {
 protected:
  DrawnPoses() { letters_.add("A", 3, 51); }

  LetterPresses letters_;
  RecognitionBins bins_{.lattice = {.x_mm = {-9.0, 11.0, 10},
                                    .y_mm = {2.0, 6.0, 8},
                                    .theta_rad = {1.0, 2.0, 4},
                                    .pivot_mm = {30.0, -40.0}},
                        .auto_pivot = false};
  Random random_{52, Stream::unknowns};
};

TEST_F(DrawnPoses, ReachAllOfTheRegionWithEveryElementInItsPlace) {
  const Press& press = letters_.presses[0];
  std::vector<int> seen(static_cast<std::size_t>(bins_.lattice.bins()));
  for (int i = 0; i < 6400; ++i) {
    const Press unknown = as_unknown(press, bins_, random_);
    expect_same_places(press, unknown);
    const glm::dvec2 pivot = *unknown.T_object_robot * bins_.lattice.pivot_mm;
    ASSERT_TRUE(pivot.x >= -9.0 - 1e-9 && pivot.x <= 11.0 + 1e-9) << pivot.x;
    ASSERT_TRUE(pivot.y >= 2.0 - 1e-9 && pivot.y <= 6.0 + 1e-9) << pivot.y;
    ++seen[static_cast<std::size_t>(bins_.lattice.bin_of(*unknown.T_object_robot))];
  }
  // 20 a bin in the mean: none has a chance of 2e-9 a bin to stay empty.
  for (const int count : seen) {
    EXPECT_GT(count, 0);
  }
}

TEST_F(DrawnPoses, AtAnAutomaticPivotKeepThePlaceWithinHalfABin) {
  const Press& press = letters_.presses[1];
  bins_.lattice.pivot_mm = {};
  bins_.auto_pivot = true;
  double farthest_mm = 0.0;
  for (int i = 0; i < 300; ++i) {
    const Press unknown = as_unknown(press, bins_, random_);
    expect_same_places(press, unknown);
    const glm::dvec2 apart =
        unknown.T_object_robot->translation_mm - press.T_object_robot->translation_mm;
    EXPECT_LE(std::abs(apart.x), 1.0);
    EXPECT_LE(std::abs(apart.y), 0.25);
    farthest_mm = std::max(farthest_mm, std::abs(apart.x));
    EXPECT_TRUE(unknown.T_object_robot->theta_rad >= 1.0 &&
                unknown.T_object_robot->theta_rad <= 2.0);
  }
  EXPECT_GT(farthest_mm, 0.9);
}

TEST_F(DrawnPoses, OfAFixedAngleHaveThatAngle) {
  bins_.lattice.theta_rad = {0.5, 0.5, 1};
  EXPECT_EQ(as_unknown(letters_.presses[0], bins_, random_).T_object_robot->theta_rad, 0.5);
}

TEST_F(DrawnPoses, OfSeveralPressesTogetherKeepAllPlaces) {
  const std::vector<const Press*> own{&letters_.presses[0], &letters_.presses[1],
                                      &letters_.presses[2]};
  const Press all = together(own);
  ASSERT_EQ(all.touches.size(), 3U);
  const Press moved = as_unknown(all, bins_, random_);
  for (std::size_t i = 0; i < own.size(); ++i) {
    Press alone = moved;
    alone.touches = {moved.touches[i]};
    expect_same_places(*own[i], alone);
  }
}

}  // namespace palpate::drawn_poses_test
