#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

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

/// Checks that values are uniform over [lower, upper): inside it, in every eighth of it.
class Coverage {
 public:
  Coverage(double lower, double upper) : lower_(lower), upper_(upper) {}
  void add(double value) {
    ASSERT_GE(value, lower_);
    ASSERT_LT(value, upper_);
    ++counts_[static_cast<int>((value - lower_) / (upper_ - lower_) * eighths)];
    ++total_;
  }
  void expect_uniform() const {
    for (const int count : counts_) {
      // Five standard errors of a binomial proportion of 1/8.
      EXPECT_NEAR(count, total_ / 8.0, 5.0 * std::sqrt(total_ * 7.0 / 64.0));
    }
  }

 private:
  static constexpr int eighths = 8;
  double lower_;
  double upper_;
  int counts_[eighths] = {};
  int total_ = 0;
};

TEST(TouchPoses, RandomPosesAreUniformOverTheGridAndRepeatable) {
  const std::vector<Pose> poses = random_poses(20'000, 9);
  ASSERT_EQ(poses.size(), 20'000U);
  Coverage x(-10.2, 10.2);
  Coverage y(-10.2, 10.2);
  Coverage theta(0.0, 2.0 * std::numbers::pi);
  for (const Pose& pose : poses) {
    x.add(pose.translation_mm.x);
    y.add(pose.translation_mm.y);
    theta.add(pose.theta_rad);
  }
  x.expect_uniform();
  y.expect_uniform();
  theta.expect_uniform();

  // More poses of the same seed begin with the same ones.
  const std::vector<Pose> few = random_poses(3, 9);
  EXPECT_EQ(few[2].translation_mm, poses[2].translation_mm);
  EXPECT_NE(random_poses(1, 10)[0].translation_mm, poses[0].translation_mm);
  EXPECT_TRUE(random_poses(0, 9).empty());
  EXPECT_THROW(random_poses(-1, 9), Error);
}

TEST(TouchPoses, RandomObjectPosesAreUniformAndIndependentOfTheTouches) {
  Coverage x(-10.0, 10.0);
  Coverage y(-10.0, 10.0);
  Coverage theta(0.0, 2.0 * std::numbers::pi);
  constexpr int n = 4000;
  double correlation = 0.0;
  for (int seed = 0; seed < n; ++seed) {
    const Pose pose = random_object_pose(seed);
    x.add(pose.translation_mm.x);
    y.add(pose.translation_mm.y);
    theta.add(pose.theta_rad);
    // Both have a variance of one third of their squared half range.
    correlation +=
        pose.translation_mm.x / 10.0 * (random_poses(1, seed)[0].translation_mm.x / 10.2) * 3.0 / n;
  }
  x.expect_uniform();
  y.expect_uniform();
  theta.expect_uniform();
  EXPECT_NEAR(correlation, 0.0, 5.0 / std::sqrt(n));  // five standard errors
}

}  // namespace palpate::touch_poses_test
