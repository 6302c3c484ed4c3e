#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "palpate/estimate.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_error.hpp"
#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/synthetic.hpp"

namespace palpate::pose_test {

constexpr double pi = std::numbers::pi;

// Coordinates of a few hundred mm lose about 1e-13 mm to each rotation in float64.
constexpr double rounding = 1e-11;

std::vector<Pose> some_poses(double most_mm, double most_rad) {
  Uniform random(3);
  std::vector<Pose> poses{{}, {{1.0, 0.0}, 0.0}, {{0.0, 0.0}, pi}};
  for (int i = 0; i < 12; ++i) {
    poses.push_back(
        {{random(-most_mm, most_mm), random(-most_mm, most_mm)}, random(-most_rad, most_rad)});
  }
  return poses;
}

void expect_same_pose(const Pose& a, const Pose& b) {
  EXPECT_NEAR(a.translation_mm.x, b.translation_mm.x, rounding);
  EXPECT_NEAR(a.translation_mm.y, b.translation_mm.y, rounding);
  EXPECT_NEAR(a.theta_rad, b.theta_rad, rounding);
}

TEST(Pose, IsOfAGroupThatActsInTurn) {
  const std::vector<Pose> poses = some_poses(300.0, 20.0);
  const glm::dvec2 p{12.5, -7.25};
  for (std::size_t i = 0; i + 2 < poses.size(); ++i) {
    const Pose &a = poses[i], &b = poses[i + 1], &c = poses[i + 2];
    expect_same_pose(Pose{} * a, a);
    expect_same_pose(a * Pose{}, a);
    expect_same_pose(inverse(a) * a, {});
    expect_same_pose(a * inverse(a), {});
    expect_same_pose((a * b) * c, a * (b * c));
    const glm::dvec2 at_once = (a * b) * p;
    const glm::dvec2 in_turn = a * (b * p);
    EXPECT_NEAR(at_once.x, in_turn.x, rounding);
    EXPECT_NEAR(at_once.y, in_turn.y, rounding);
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

// T_robot_object with its covariance, from T_object_robot with its own.
std::array<double, 9> rows_of(const glm::dmat3& matrix) {
  std::array<double, 9> rows{};
  for (int i = 0; i < 9; ++i) {
    rows[static_cast<std::size_t>(i)] = matrix[i % 3][i / 3];
  }
  return rows;
}

glm::dvec3 inverted(const glm::dvec3& place) {
  const Pose T = inverse(Pose{{place.x, place.y}, place.z});
  return {T.translation_mm, T.theta_rad};
}

TEST(ObjectPose, IsThePosesInverseAndItsCovarianceCarriedByTheJacobian) {
  // Deviations of about 0.3 mm, 0.2 mm and 0.01 rad, correlated.
  const glm::dmat3 root{{0.3, 0.1, 0.004}, {0.0, 0.2, -0.003}, {0.0, 0.0, 0.01}};
  const glm::dmat3 covariance = root * glm::transpose(root);
  for (const glm::dvec3& place : {glm::dvec3(0.0), glm::dvec3(12.0, -7.0, 0.8),
                                  glm::dvec3(-3.0, 90.0, -2.9), glm::dvec3(250.0, 40.0, 5.0)}) {
    SCOPED_TRACE(place.x);
    // Central differences over 2e-4: their own error is the third derivative, up to 250 mm, times
    // 1e-8 / 6, and rounding, 1e-13 mm / 1e-4.
    glm::dmat3 jacobian{0.0};
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 step{0.0};
      step[axis] = 1e-4;
      jacobian[axis] = (inverted(place + step) - inverted(place - step)) / 2e-4;
    }
    const std::array<double, 9> expected =
        rows_of(jacobian * covariance * glm::transpose(jacobian));
    const ObjectPose pose = inverse(RefinedPose{.T_object_robot = {{place.x, place.y}, place.z},
                                                .covariance = rows_of(covariance)});
    EXPECT_EQ(pose.T_robot_object.translation_mm, glm::dvec2(inverted(place)));
    EXPECT_EQ(pose.T_robot_object.theta_rad, inverted(place).z);
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_NEAR(pose.covariance[i], expected[i], 1e-7 * (1.0 + std::abs(expected[i]))) << i;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_DOUBLE_EQ(pose.sd()[i], std::sqrt(pose.covariance[4 * i]));
    }
  }
}

// The object lies 2 m from the robot's origin and is known to 0.1 mm and 0.01 rad: seen from the
// object, the robot's origin is uncertain by 20 mm; seen from the robot, the object is not.
TEST(ObjectPose, AFarRobotOriginDoesNotBlurTheObject) {
  const Pose T_robot_object{{1600.0, 1200.0}, 2.0};
  const std::array<double, 9> known{0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 1e-4};
  // The inverse undoes itself, the covariance included, whichever of the two frames is given.
  const ObjectPose seen =
      inverse(RefinedPose{.T_object_robot = T_robot_object, .covariance = known});
  EXPECT_NEAR(std::hypot(seen.sd()[0], seen.sd()[1]), 20.0, 0.01);
  const ObjectPose back =
      inverse(RefinedPose{.T_object_robot = seen.T_robot_object, .covariance = seen.covariance});
  for (std::size_t i = 0; i < 9; ++i) {
    // Terms of (2000 mm)^2 times 1e-4 rad^2 cancel: some 1e-16 of 400 mm^2 remain.
    EXPECT_NEAR(back.covariance[i], known[i], 1e-12) << "entry " << i;
  }
}

/// An L of 2 mm cells: occupied at (10, 20), (12, 20), (14, 20) and (10, 22).
OccupancyGrid letter_l() {
  return {.label = "L",
          .cell_mm = 2.0,
          .origin_mm = {10.0, 20.0},
          .nx = 3,
          .ny = 2,
          .log_odds = {1.0F, 0.5F, 9.0F, 0.1F, 0.0F, -3.0F}};
}

constexpr double metric_rounding = 1e-10;  // of squares

TEST(BodyOf, IsUniformOverTheOccupiedCells) {
  const Body body = body_of(letter_l());
  // x: 10, 12, 14, 10 and y: 20, 20, 20, 22.
  EXPECT_DOUBLE_EQ(body.centroid_mm.x, 11.5);
  EXPECT_DOUBLE_EQ(body.centroid_mm.y, 20.5);
  // Mean squares: x (2.25 + 0.25 + 6.25 + 2.25) / 4, y (3 * 0.25 + 2.25) / 4.
  EXPECT_DOUBLE_EQ(body.inertia_mm2, 2.75 + 0.75);
}

TEST(BodyOf, RefusesAMapWithoutOccupiedCells) {
  OccupancyGrid map = letter_l();
  map.log_odds.assign(6, 0.0F);
  expect_named(input_error([&] { body_of(map); }), {"'L'"});
}

// The root mean squared displacement of the occupied cells, the least of all turns of the symmetry;
// 0 for the truth itself.
TEST(PoseError, IsTheReferences) {
  OccupancyGrid map = letter_l();
  const std::vector<Pose> poses = some_poses(100.0, 7.0);
  for (map.symmetry = 0; map.symmetry < 5; ++map.symmetry) {
    for (const Pose& estimate : poses) {
      for (const Pose& truth : poses) {
        EXPECT_NEAR(pose_error_mm(body_of(map), map.symmetry, estimate, truth),
                    reference::pose_error_mm(map, estimate, truth), metric_rounding);
      }
    }
  }
}

TEST(NearestEqualPose, IsNoErrorAwayFromTheTruthAndAtMostHalfATurnOfTheSymmetryFromTheEstimate) {
  const Body body = body_of(letter_l());
  const std::vector<Pose> poses = some_poses(100.0, 7.0);
  for (const int symmetry : {0, 1, 2, 3, 6}) {
    for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
      const Pose nearest = nearest_equal_pose(body, symmetry, poses[i], poses[i + 1]);
      EXPECT_NEAR(pose_error_mm(body, symmetry, nearest, poses[i + 1]), 0.0, metric_rounding);
      // Compared with the nearest pose, the symmetry has no turn to forgive.
      EXPECT_NEAR(pose_error_mm(body, 1, poses[i], nearest),
                  pose_error_mm(body, symmetry, poses[i], poses[i + 1]), metric_rounding);
    }
  }
}

TEST(PoseError, OfATruthThatIsAbsurdlyFarAwayIsFinite) {
  // The square of 1e200 mm is infinite.
  const double error_mm = pose_error_mm(body_of(letter_l()), 1, {}, {{1e200, 0.0}, 0.0});
  EXPECT_NEAR(error_mm / 1e200, 1.0, 1e-12);
}

}  // namespace palpate::pose_test
