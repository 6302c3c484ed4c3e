#include "model/displacement_points.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::displacement_points_test {

TEST(NormalQuantile, InvertsTheDistributionFunction) {
  for (const double x : {-6.0, -2.5, -1.0, -0.1, 0.0, 0.3, 1.7, 4.0}) {
    const double probability = 0.5 * std::erfc(-x / std::sqrt(2.0));
    EXPECT_NEAR(normal_quantile(probability), x, 1e-8);
  }
}

TEST(DisplacementPoints, HaveTheMomentsOfTheDistribution) {
  const DisplacementSd sd{.mm = 1.5, .rad = 0.05};
  const std::vector<Pose> points = displacement_points(sd, 256);
  double x = 0.0;
  double xx = 0.0;
  double yy = 0.0;
  double xy = 0.0;
  double tt = 0.0;
  for (const Pose& point : points) {
    x += point.translation_mm.x / 256.0;
    xx += point.translation_mm.x * point.translation_mm.x / 256.0;
    yy += point.translation_mm.y * point.translation_mm.y / 256.0;
    xy += point.translation_mm.x * point.translation_mm.y / 256.0;
    tt += point.theta_rad * point.theta_rad / 256.0;
  }
  // Independent random points would be off by 6 and 9 %.
  EXPECT_NEAR(x / sd.mm, 0.0, 0.02);
  EXPECT_NEAR(xx / (sd.mm * sd.mm), 1.0, 0.03);
  EXPECT_NEAR(yy / (sd.mm * sd.mm), 1.0, 0.03);
  EXPECT_NEAR(xy / (sd.mm * sd.mm), 0.0, 0.08);
  EXPECT_NEAR(tt / (sd.rad * sd.rad), 1.0, 0.03);
}

TEST(DisplacementPoints, AreOneWhereNothingIsDisplaced) {
  const std::vector<Pose> points = displacement_points({}, 256);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_EQ(points.front().translation_mm, glm::dvec2(0.0));
  EXPECT_EQ(points.front().theta_rad, 0.0);
}

TEST(DisplacementPoints, LeaveAnExactPartAlone) {
  for (const Pose& point : displacement_points({.mm = 1.0}, 16)) {
    EXPECT_EQ(point.theta_rad, 0.0);
  }
}

TEST(Slipped, TurnsTheObjectAboutItsCentroidAndMovesIt) {
  const Pose T_object_robot{{4.0, -7.0}, 0.8};
  const glm::dvec2 centroid_mm{12.0, 5.0};
  const Pose slip{{0.5, -0.25}, 0.3};
  const Pose after = slipped(T_object_robot, slip, centroid_mm);
  const glm::dvec2 q = inverse(T_object_robot) * centroid_mm;
  const glm::dvec2 moved = after * q - centroid_mm;
  EXPECT_NEAR(moved.x, 0.5, 1e-12) << "rounding of some 10 mm in float64";
  EXPECT_NEAR(moved.y, -0.25, 1e-12);
  EXPECT_NEAR(after.theta_rad, 1.1, 1e-12);
}

}  // namespace palpate::displacement_points_test
