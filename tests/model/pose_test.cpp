#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"
#include "palpate/pose.hpp"
#include "palpate/pose_error.hpp"
#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::pose_test {

constexpr double pi = std::numbers::pi;

// Coordinates of a few hundred mm lose about 1e-13 mm to each rotation in float64, those below 1e4
// mm some 1e-12.
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

TEST(PoseError, OfATruthFarAwayIsFiniteAndOfAMapWithoutOccupiedCellsRefused) {
  // The square of 1e200 mm is infinite.
  OccupancyGrid map = letter_l();
  const double error_mm = pose_error_mm(body_of(map), 1, {}, {{1e200, 0.0}, 0.0});
  EXPECT_NEAR(error_mm / 1e200, 1.0, 1e-12);
  map.log_odds.assign(6, 0.0F);  // no cell is occupied
  expect_named(input_error([&] { body_of(map); }), {"'L'"});
}

TEST(PoseLattice, PivotHasTheLatticesCoordinatesInTheObjectFrame) {
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 4},
                            .y_mm = {-3.0, 9.0, 3},
                            .theta_rad = {0.0, 6.0, 5},
                            .pivot_mm = {700.0, -400.0}};
  for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
    const Pose pose = lattice.T_object_robot(bin);
    const glm::dvec2 at = pose * lattice.pivot_mm;
    EXPECT_NEAR(at.x, lattice.x_mm.centre(static_cast<int>(bin % 4)), rounding);
    EXPECT_NEAR(at.y, lattice.y_mm.centre(static_cast<int>(bin / 4 % 3)), rounding);
    const Pose expected = reference::bin_pose(lattice, bin);
    EXPECT_NEAR(pose.translation_mm.x, expected.translation_mm.x, rounding);
    EXPECT_NEAR(pose.translation_mm.y, expected.translation_mm.y, rounding);
    EXPECT_NEAR(pose.theta_rad, expected.theta_rad, rounding);
  }
}

TEST(PoseLattice, BinsOfAllDimensionsMayExceed32Bits) {
  const PoseLattice lattice{
      .x_mm = {0.0, 1.0, 100000}, .y_mm = {0.0, 1.0, 100000}, .theta_rad = {0.0, 1.0, 10}};
  EXPECT_EQ(lattice.bins(), 100000000000);
  EXPECT_NEAR(lattice.T_object_robot(lattice.bins() - 1).theta_rad, 0.95, rounding);
}

void expect_refused(const PoseLattice& lattice, const char* field) {
  expect_named(input_error([&] { lattice.validate(); }), {field});
  expect_named(input_error([&] { lattice.bin_of({}); }), {field});
}

TEST(PoseLattice, RefusesWhatIsNoLattice) {
  PoseLattice().validate();
  PoseLattice{.x_mm = {-1e9, 1e9, 5}, .theta_rad = {1e9 - 1.0, 1e9, 5}, .pivot_mm = {1e9, -1e9}}
      .validate();
  expect_refused({.x_mm = {-1.0, 1.0, 0}}, "x_mm");
  input_error([] { PoseLattice().T_object_robot(std::int64_t{10'000}); });
  input_error([] { PoseLattice{.x_mm = {-1.0, 1.0, 0}}.T_object_robot(std::int64_t{0}); });
  expect_refused({.y_mm = {-1.0, 1.0, -3}}, "y_mm");
  expect_refused({.theta_rad = {1.0, 0.0, 4}}, "theta_rad");
  // Float64 keeps no digits beyond 1e9.
  for (const double far : {1.1e9, 1e300, infinity, nan}) {
    expect_refused({.x_mm = {-far, 1.0, 4}}, "x_mm");
    expect_refused({.y_mm = {0.0, far, 4}}, "y_mm");
    expect_refused({.theta_rad = {0.0, far, 4}}, "theta_rad");
    expect_refused({.pivot_mm = {far, 0.0}}, "pivot_mm");
    expect_refused({.pivot_mm = {0.0, -far}}, "pivot_mm");
  }
}

TEST(PoseLattice, RefusesAnglesThatWouldCountTwice) {
  for (const double lower : {0.0, -1.0, 1e4, -1e9}) {
    const auto with_angles = [lower](double width) {
      return PoseLattice{.theta_rad = {lower, lower + width, 4}};
    };
    with_angles(two_pi).validate();
    EXPECT_TRUE(with_angles(two_pi).full_circle()) << lower;
    expect_refused(with_angles(two_pi + 1e-6 + 1e-15 * std::abs(lower)), "theta_rad");
    expect_refused(with_angles(2.0 * two_pi), "at most 2 pi");
    with_angles(6.0).validate();
    EXPECT_FALSE(with_angles(6.0).full_circle()) << lower;
  }
}

TEST(PoseLattice, BinOfAPoseIsTheBinThatHoldsIt) {
  const PoseLattice full{.x_mm = {-5.0, 5.0, 4},
                         .y_mm = {-3.0, 9.0, 3},
                         .theta_rad = {-1.0, -1.0 + two_pi, 5},
                         .pivot_mm = {700.0, -400.0}};
  PoseLattice part = full;
  part.theta_rad = {6.0, 8.0, 5};
  PoseLattice fixed = full;
  fixed.x_mm = {1.0, 1.0, 1};
  for (const PoseLattice& lattice : {full, part, fixed}) {
    const double step_rad = lattice.theta_rad.step();
    for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
      const Pose centre = lattice.T_object_robot(bin);
      const glm::dvec2 at = centre * lattice.pivot_mm;
      for (const double share : {-0.49, 0.0, 0.49}) {
        Pose pose = lattice.T_object_robot(at.x + share * lattice.x_mm.step(),
                                           at.y - share * lattice.y_mm.step(),
                                           centre.theta_rad + share * step_rad);
        for (const double turns : {0.0, -1.0, 2.0}) {
          pose.theta_rad += turns * two_pi;
          EXPECT_EQ(lattice.bin_of(pose), bin) << share << " of a step, " << turns << " turns on";
        }
      }
    }
  }
}

TEST(PoseLattice, BinOfAPoseOutsideIsTheNearest) {
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 4}, .y_mm = {-3.0, 9.0, 3}, .theta_rad = {0, 2, 5}};
  const auto bin_of = [&](double x, double y, double theta) {
    return lattice.bin_of(lattice.T_object_robot(x, y, theta));
  };
  EXPECT_EQ(bin_of(-1e12, 0.0, 1.0), 2 * 12 + 0 * 4 + 0);
  EXPECT_EQ(bin_of(5.0, 1e12, 1.0), 2 * 12 + 2 * 4 + 3);
  EXPECT_EQ(bin_of(0.1, 0.0, 2.5), 4 * 12 + 0 * 4 + 2);
  EXPECT_EQ(bin_of(0.1, 0.0, -0.5), 0 * 12 + 0 * 4 + 2);
  EXPECT_THROW(bin_of(infinity, 0.0, 0.0), Error);
  EXPECT_THROW(bin_of(0.0, 0.0, nan), Error);
}

}  // namespace palpate::pose_test
