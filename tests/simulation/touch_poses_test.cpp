#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/simulation.hpp"

namespace palpate::touch_poses_test {

TEST(TouchPoses, TrainingGridHasTwelveAnglesAtSixteenPositions) {
  const std::vector<Pose> poses = training_grid();
  ASSERT_EQ(poses.size(), 192U);
  std::set<std::tuple<long, long, long>> distinct;
  glm::dvec2 mean{0.0};
  for (const Pose& pose : poses) {
    // Positions in half pitches from the centre are odd: -3, -1, 1, 3. Angles in twelfths.
    const glm::dvec2 position = pose.translation_mm / 3.4;
    const double angle = pose.theta_rad / (2.0 * std::numbers::pi / 12.0);
    // 1e-12: rounding only.
    EXPECT_NEAR(std::abs(std::abs(position.x) - 2.0), 1.0, 1e-12);
    EXPECT_NEAR(std::abs(std::abs(position.y) - 2.0), 1.0, 1e-12);
    EXPECT_NEAR(angle, std::round(angle), 1e-12);
    EXPECT_GE(angle, 0.0);
    EXPECT_LT(angle, 11.5);
    distinct.emplace(std::lround(position.x), std::lround(position.y), std::lround(angle));
    mean += pose.translation_mm;
  }
  EXPECT_EQ(distinct.size(), 192U);
  EXPECT_NEAR(mean.x, 0.0, 1e-9);
  EXPECT_NEAR(mean.y, 0.0, 1e-9);
}

/// Expects values spread uniformly over [lower, upper): inside it, in every eighth of it.
void expect_uniform(const std::vector<double>& values, double lower, double upper) {
  std::array<int, 8> counts{};
  for (const double value : values) {
    ASSERT_GE(value, lower);
    ASSERT_LT(value, upper);
    ++counts.at(static_cast<std::size_t>((value - lower) / (upper - lower) * 8.0));
  }
  const auto n = static_cast<double>(values.size());
  for (const int count : counts) {
    // Five standard errors of a binomial proportion of 1/8.
    EXPECT_NEAR(count, n / 8.0, 5.0 * std::sqrt(n * 7.0 / 64.0));
  }
}

/// Expects x and y uniform within half_mm of 0, and theta over the circle.
void expect_uniform(const std::vector<Pose>& poses, double half_mm) {
  std::array<std::vector<double>, 3> of;
  for (const Pose& pose : poses) {
    of[0].push_back(pose.translation_mm.x);
    of[1].push_back(pose.translation_mm.y);
    of[2].push_back(pose.theta_rad);
  }
  expect_uniform(of[0], -half_mm, half_mm);
  expect_uniform(of[1], -half_mm, half_mm);
  expect_uniform(of[2], 0.0, 2.0 * std::numbers::pi);
}

TEST(TouchPoses, RandomPosesAreUniformOverTheGridAndRepeatable) {
  const std::vector<Pose> poses = random_poses(20'000, 9);
  ASSERT_EQ(poses.size(), 20'000U);
  expect_uniform(poses, 10.2);
  // More poses of the same seed begin with the same ones.
  const std::vector<Pose> few = random_poses(3, 9);
  EXPECT_EQ(few[2].translation_mm, poses[2].translation_mm);
  EXPECT_NE(random_poses(1, 10)[0].translation_mm, poses[0].translation_mm);
  EXPECT_TRUE(random_poses(0, 9).empty());
  EXPECT_THROW(random_poses(-1, 9), Error);
}

TEST(TouchPoses, RandomObjectPosesAreUniformAndIndependentOfTheTouches) {
  constexpr int n = 2000;
  std::vector<Pose> poses;
  double correlation = 0.0;
  for (int seed = 0; seed < n; ++seed) {
    poses.push_back(random_object_pose(seed));
    // Both have a variance of one third of their squared half range.
    correlation += poses.back().translation_mm.x / 10.0 *
                   (random_poses(1, seed)[0].translation_mm.x / 10.2) * 3.0 / n;
  }
  expect_uniform(poses, 10.0);
  EXPECT_NEAR(correlation, 0.0, 5.0 / std::sqrt(n));  // five standard errors
}

}  // namespace palpate::touch_poses_test
