#include "palpate/pose_error.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "reference/reference.hpp"

namespace palpate::pose_error_test {

constexpr double pi = std::numbers::pi;

// Float64 rounding of coordinates of a few hundred mm.
constexpr double rounding = 1e-10;

/// An L of 2 mm cells: occupied at (10, 20), (12, 20), (14, 20) and (10, 22).
OccupancyGrid letter_l() {
  return {.label = "L",
          .cell_mm = 2.0,
          .origin_mm = {10.0, 20.0},
          .nx = 3,
          .ny = 2,
          .log_odds = {1.0F, 0.5F, 9.0F, 0.1F, 0.0F, -3.0F}};
}

std::vector<Pose> some_poses() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> mm(-100.0, 100.0);
  std::uniform_real_distribution<double> rad(-7.0, 7.0);
  std::vector<Pose> poses;
  for (int i = 0; i < 12; ++i) {
    poses.push_back({{mm(random), mm(random)}, rad(random)});
  }
  return poses;
}

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
  try {
    body_of(map);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("'L'"), std::string::npos) << error.what();
  }
}

TEST(PoseError, IsZeroOnlyForTheTruth) {
  const Body body = body_of(letter_l());
  const std::vector<Pose> poses = some_poses();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const double error = pose_error_mm(body, 1, poses[i], poses[k]);
      if (i == k) {
        EXPECT_EQ(error, 0.0);
      } else {
        EXPECT_GT(error, 0.1);
      }
    }
  }
}

TEST(PoseError, AMillimetreOfTranslationScoresOne) {
  const Body body = body_of(letter_l());
  for (const Pose& T_robot_object : some_poses()) {
    for (const glm::dvec2 step : {glm::dvec2(1.0, 0.0), glm::dvec2(0.6, -0.8)}) {
      const Pose moved{T_robot_object.translation_mm + step, T_robot_object.theta_rad};
      EXPECT_NEAR(pose_error_mm(body, 1, inverse(moved), inverse(T_robot_object)), 1.0, rounding);
    }
  }
}

TEST(PoseError, ATurnAboutTheCentroidDisplacesByTheInertia) {
  const Body body = body_of(letter_l());
  const double angle = 0.3;
  // T_object_robot of a body turned about its own centroid.
  const Pose to_centroid{-body.centroid_mm, 0.0};
  const Pose turned = inverse(to_centroid) * Pose{{0.0, 0.0}, angle} * to_centroid;
  EXPECT_NEAR(pose_error_mm(body, 1, turned, {}),
              std::sqrt(2.0 * body.inertia_mm2 * (1.0 - std::cos(angle))), rounding);
  EXPECT_NEAR(pose_error_mm(body, 0, turned, {}), 0.0, rounding) << "full symmetry has no angle";
}

TEST(PoseError, IsTheRootMeanSquaredDisplacementOfTheCells) {
  const OccupancyGrid map = letter_l();
  const std::vector<Pose> poses = some_poses();
  for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
    double sum = 0.0;
    for (int j = 0; j < map.ny; ++j) {
      for (int k = 0; k < map.nx; ++k) {
        if (map.at(k, j) > 0.0F) {
          const glm::dvec2 d =
              inverse(poses[i]) * map.centre_mm(k, j) - inverse(poses[i + 1]) * map.centre_mm(k, j);
          sum += d.x * d.x + d.y * d.y;
        }
      }
    }
    EXPECT_NEAR(pose_error_mm(body_of(map), 1, poses[i], poses[i + 1]), std::sqrt(sum / 4.0),
                rounding);
  }
}

TEST(PoseError, SymmetryForgivesItsOwnTurns) {
  OccupancyGrid bar = letter_l();  // occupied at x = 10, 12, 14 of the lower row
  bar.log_odds = {1.0F, 1.0F, 1.0F, -1.0F, -1.0F, -1.0F};
  const Body body = body_of(bar);
  const Pose to_centroid{-body.centroid_mm, 0.0};
  const auto turned = [&](double angle) {
    return inverse(to_centroid) * Pose{{0.0, 0.0}, angle} * to_centroid;
  };
  EXPECT_NEAR(pose_error_mm(body, 2, turned(pi), {}), 0.0, rounding);
  EXPECT_NEAR(pose_error_mm(body, 2, turned(pi + 0.1), {}), pose_error_mm(body, 1, turned(0.1), {}),
              rounding);
  EXPECT_GT(pose_error_mm(body, 1, turned(pi), {}), 2.0);
  EXPECT_NEAR(pose_error_mm(body, 3, turned(2.0 * pi / 3.0), {}), 0.0, rounding);
  EXPECT_NEAR(pose_error_mm(body, 1, turned(2.0 * pi), {}), 0.0, rounding);
}

TEST(NearestEqualPose, IsNoErrorAwayFromTheTruthAndAtMostHalfATurnOfTheSymmetryFromTheEstimate) {
  const Body body = body_of(letter_l());
  const std::vector<Pose> poses = some_poses();
  for (const int symmetry : {0, 1, 2, 3, 6}) {
    for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
      const Pose nearest = nearest_equal_pose(body, symmetry, poses[i], poses[i + 1]);
      EXPECT_NEAR(pose_error_mm(body, symmetry, nearest, poses[i + 1]), 0.0, rounding);
      // Compared with the nearest pose, the symmetry has no turn to forgive.
      EXPECT_NEAR(pose_error_mm(body, 1, poses[i], nearest),
                  pose_error_mm(body, symmetry, poses[i], poses[i + 1]), rounding);
    }
  }
}

TEST(PoseError, DoesNotDependOnTheRobotFrameNorOnTheOrderOfThePoses) {
  const Body body = body_of(letter_l());
  const std::vector<Pose> poses = some_poses();
  for (std::size_t i = 0; i + 2 < poses.size(); ++i) {
    const double error = pose_error_mm(body, 1, poses[i], poses[i + 1]);
    const Pose& T_robot_other = poses[i + 2];
    EXPECT_NEAR(pose_error_mm(body, 1, poses[i] * T_robot_other, poses[i + 1] * T_robot_other),
                error, rounding);
    EXPECT_NEAR(pose_error_mm(body, 1, poses[i + 1], poses[i]), error, rounding);
  }
}

TEST(PoseError, AgreesWithTheReference) {
  OccupancyGrid map = letter_l();
  const std::vector<Pose> poses = some_poses();
  for (map.symmetry = 0; map.symmetry < 5; ++map.symmetry) {
    for (std::size_t i = 0; i + 1 < poses.size(); ++i) {
      EXPECT_NEAR(pose_error_mm(body_of(map), map.symmetry, poses[i], poses[i + 1]),
                  reference::pose_error_mm(map, poses[i], poses[i + 1]), rounding);
    }
  }
}

TEST(PoseError, OfATruthThatIsAbsurdlyFarAwayIsFinite) {
  const Body body = body_of(letter_l());
  // The square of 1e200 mm is infinite.
  EXPECT_NEAR(pose_error_mm(body, 1, {}, {{1e200, 0.0}, 0.0}) / 1e200, 1.0, 1e-12);
}

}  // namespace palpate::pose_error_test
