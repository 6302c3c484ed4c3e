// T_robot_object with its covariance, from T_object_robot with its own.

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "palpate/estimate.hpp"

namespace palpate::object_pose_test {

std::array<double, 9> rows_of(const glm::dmat3& matrix) {
  std::array<double, 9> rows{};
  for (int i = 0; i < 9; ++i) {
    rows[static_cast<std::size_t>(i)] = matrix[i % 3][i / 3];
  }
  return rows;
}

/// A covariance with correlations, of deviations of about 0.3 mm, 0.2 mm and 0.01 rad.
glm::dmat3 sample_covariance() {
  const glm::dmat3 root{{0.3, 0.1, 0.004}, {0.0, 0.2, -0.003}, {0.0, 0.0, 0.01}};
  return root * glm::transpose(root);
}

glm::dvec3 inverted(const glm::dvec3& place) {
  const Pose T = inverse(Pose{{place.x, place.y}, place.z});
  return {T.translation_mm, T.theta_rad};
}

const glm::dvec3 places[] = {{0, 0, 0}, {12.0, -7.0, 0.8}, {-3.0, 90.0, -2.9}, {250.0, 40.0, 5.0}};

TEST(ObjectPose, IsThePosesInverse) {
  for (const glm::dvec3& place : places) {
    const ObjectPose pose = inverse(RefinedPose{.T_object_robot = {{place.x, place.y}, place.z}});
    const glm::dvec3 expected = inverted(place);
    EXPECT_EQ(pose.T_robot_object.translation_mm, glm::dvec2(expected));
    EXPECT_EQ(pose.T_robot_object.theta_rad, expected.z);
    EXPECT_EQ(pose.sd(), (std::array<double, 3>{}));
  }
}

TEST(ObjectPose, CovarianceIsCarriedByTheJacobianOfTheInverse) {
  const glm::dmat3 covariance = sample_covariance();
  for (const glm::dvec3& place : places) {
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
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_NEAR(pose.covariance[i], expected[i], 1e-7 * (1.0 + std::abs(expected[i])))
          << "entry " << i << " at theta " << place.z;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_DOUBLE_EQ(pose.sd()[i], std::sqrt(pose.covariance[4 * i]));
    }
  }
}

TEST(ObjectPose, DeviatesAsInvertedSamplesDo) {
  const glm::dmat3 root{{0.3, 0.1, 0.004}, {0.0, 0.2, -0.003}, {0.0, 0.0, 0.01}};
  const glm::dvec3 place = places[2];
  std::mt19937_64 random(17);
  std::normal_distribution<double> normal;
  constexpr int samples = 100'000;
  glm::dmat3 moment{0.0};
  glm::dvec3 mean{0.0};
  for (int i = 0; i < samples; ++i) {
    const glm::dvec3 moved =
        inverted(place + root * glm::dvec3(normal(random), normal(random), normal(random))) -
        inverted(place);
    mean += moved / static_cast<double>(samples);
    moment += glm::outerProduct(moved, moved) / static_cast<double>(samples);
  }
  const std::array<double, 9> sampled = rows_of(moment - glm::outerProduct(mean, mean));
  const ObjectPose pose = inverse(RefinedPose{.T_object_robot = {{place.x, place.y}, place.z},
                                              .covariance = rows_of(sample_covariance())});
  for (int i = 0; i < 9; ++i) {
    // A sampled covariance has a relative standard error of sqrt(2 / samples) = 0.45 %; four of
    // those, and 0.1 % for the curvature of a turn by 0.01 rad.
    const double scale = pose.sd()[i / 3] * pose.sd()[i % 3];
    EXPECT_NEAR(pose.covariance[i], sampled[i], 0.02 * scale) << "entry " << i;
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
  EXPECT_NEAR(back.T_robot_object.translation_mm.x, 1600.0, 1e-9);
  EXPECT_NEAR(back.T_robot_object.translation_mm.y, 1200.0, 1e-9);
  EXPECT_NEAR(back.T_robot_object.theta_rad, 2.0, 1e-12);
  for (std::size_t i = 0; i < 9; ++i) {
    // Terms of (2000 mm)^2 times 1e-4 rad^2 cancel: some 1e-16 of 400 mm^2 remain.
    EXPECT_NEAR(back.covariance[i], known[i], 1e-12) << "entry " << i;
  }
}

}  // namespace palpate::object_pose_test
