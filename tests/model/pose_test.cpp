#include "palpate/pose.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

namespace palpate::pose_test {

constexpr double pi = std::numbers::pi;

// Coordinates of a few hundred mm lose about 1e-13 mm to each rotation in float64.
constexpr double rounding = 1e-11;

std::vector<Pose> some_poses() {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> mm(-300.0, 300.0);
  std::uniform_real_distribution<double> rad(-20.0, 20.0);
  std::vector<Pose> poses{{}, {{1.0, 0.0}, 0.0}, {{0.0, 0.0}, pi}};
  for (int i = 0; i < 20; ++i) {
    poses.push_back({{mm(random), mm(random)}, rad(random)});
  }
  return poses;
}

void expect_same_pose(const Pose& a, const Pose& b) {
  EXPECT_NEAR(a.translation_mm.x, b.translation_mm.x, rounding);
  EXPECT_NEAR(a.translation_mm.y, b.translation_mm.y, rounding);
  EXPECT_NEAR(a.theta_rad, b.theta_rad, rounding);
}

TEST(Pose, IdentityIsNeutral) {
  for (const Pose& T : some_poses()) {
    expect_same_pose(Pose{} * T, T);
    expect_same_pose(T * Pose{}, T);
  }
}

TEST(Pose, InverseUndoesOnEitherSide) {
  for (const Pose& T : some_poses()) {
    expect_same_pose(inverse(T) * T, {});
    expect_same_pose(T * inverse(T), {});
  }
}

TEST(Pose, CompositionIsAssociativeAndActsInTurn) {
  const std::vector<Pose> poses = some_poses();
  const glm::dvec2 p{12.5, -7.25};
  for (std::size_t i = 0; i + 2 < poses.size(); ++i) {
    const Pose &a = poses[i], &b = poses[i + 1], &c = poses[i + 2];
    expect_same_pose((a * b) * c, a * (b * c));
    const glm::dvec2 at_once = (a * b) * p;
    const glm::dvec2 in_turn = a * (b * p);
    EXPECT_NEAR(at_once.x, in_turn.x, rounding);
    EXPECT_NEAR(at_once.y, in_turn.y, rounding);
  }
}

TEST(Pose, KeepsDistances) {
  const glm::dvec2 p{3.0, -1.0};
  const glm::dvec2 q{-2.0, 11.0};
  for (const Pose& T : some_poses()) {
    EXPECT_NEAR(glm::distance(T * p, T * q), 13.0, rounding);
  }
}

TEST(Pose, TurnsCounterClockwiseThenMoves) {
  const Pose T_a_b{{10.0, 20.0}, pi / 2.0};
  const glm::dvec2 p_a = T_a_b * glm::dvec2(1.0, 2.0);
  EXPECT_NEAR(p_a.x, 8.0, rounding);
  EXPECT_NEAR(p_a.y, 21.0, rounding);
}

TEST(WrapAngle, LandsInTheHalfOpenPeriodAndKeepsTheAngle) {
  for (const double period : {2.0 * pi, pi, 2.0 * pi / 3.0}) {
    for (double angle = -25.0; angle < 25.0; angle += 0.37) {
      const double wrapped = wrap_angle(angle, period);
      EXPECT_GE(wrapped, -period / 2.0);
      EXPECT_LT(wrapped, period / 2.0);
      EXPECT_NEAR(std::remainder(wrapped - angle, period), 0.0, rounding);
    }
    EXPECT_EQ(wrap_angle(period / 2.0, period), -period / 2.0);
    EXPECT_EQ(wrap_angle(-period / 2.0, period), -period / 2.0);
    EXPECT_EQ(wrap_angle(0.0, period), 0.0);
    // Just below the lower end, adding a period rounds to the excluded upper end.
    EXPECT_LT(wrap_angle(std::nextafter(-period / 2.0, -10.0), period), period / 2.0);
  }
}

}  // namespace palpate::pose_test
