#include "palpate/pose_error.hpp"

#include <gtest/gtest.h>

#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/synthetic.hpp"

namespace palpate::pose_error_test {

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
  Uniform random(5);
  std::vector<Pose> poses;
  for (int i = 0; i < 12; ++i) {
    poses.push_back({{random(-100.0, 100.0), random(-100.0, 100.0)}, random(-7.0, 7.0)});
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
  expect_named(input_error([&] { body_of(map); }), {"'L'"});
}

// The root mean squared displacement of the occupied cells, the least of all turns of the symmetry;
// 0 for the truth itself.
TEST(PoseError, IsTheReferences) {
  OccupancyGrid map = letter_l();
  const std::vector<Pose> poses = some_poses();
  for (map.symmetry = 0; map.symmetry < 5; ++map.symmetry) {
    for (const Pose& estimate : poses) {
      for (const Pose& truth : poses) {
        EXPECT_NEAR(pose_error_mm(body_of(map), map.symmetry, estimate, truth),
                    reference::pose_error_mm(map, estimate, truth), rounding);
      }
    }
  }
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

TEST(PoseError, OfATruthThatIsAbsurdlyFarAwayIsFinite) {
  // The square of 1e200 mm is infinite.
  const double error_mm = pose_error_mm(body_of(letter_l()), 1, {}, {{1e200, 0.0}, 0.0});
  EXPECT_NEAR(error_mm / 1e200, 1.0, 1e-12);
}

}  // namespace palpate::pose_error_test
