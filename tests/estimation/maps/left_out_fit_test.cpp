#include "estimation/maps/left_out_fit.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "model/body_spread.hpp"
#include "model/random.hpp"

namespace palpate::left_out_fit_test {

/// Errors of groups whose belief is some 0.5 or 0.1 mm wide along each axis, and really spread by
/// the factor, with the map's own part.
std::vector<PlaceError> drawn(const PoseScale& truth, int count) {
  Random random(7, Stream::readings);
  std::vector<PlaceError> errors;
  for (int i = 0; i < count; ++i) {
    const double sd = i % 2 == 0 ? 0.5 : 0.1;
    PlaceError error{.covariance = glm::dmat3(sd * sd)};
    for (int axis = 0; axis < 3; ++axis) {
      error.moved_mm[axis] =
          std::hypot(std::sqrt(truth.factor) * sd, truth.map_sd_mm) * random.normal();
    }
    errors.push_back(error);
  }
  return errors;
}

TEST(PoseScale, TellsWhatTouchesShareFromWhatFallsAsTheyAddUp) {
  for (const PoseScale& truth : {PoseScale{0.4, 0.0}, PoseScale{1.0, 0.08}, PoseScale{2.0, 0.2}}) {
    const PoseScale found = pose_scale_of(drawn(truth, 400)).value();
    // 600 squares tell a variance to 6 %.
    EXPECT_NEAR(found.factor / truth.factor, 1.0, 0.2);
    EXPECT_NEAR(found.map_sd_mm, truth.map_sd_mm, 0.025);
  }
  EXPECT_FALSE(pose_scale_of(drawn({}, 15))) << "too few";
}

TEST(PoseScale, MovesTheBodyAsFarAlongEveryAxis) {
  const Body body{.centroid_mm = {3.0, -2.0}, .inertia_mm2 = 49.0};
  const ObjectPose pose{{{5.0, 1.0}, 0.7}, {0.2, 0.05, 0.01, 0.05, 0.3, -0.02, 0.01, -0.02, 0.004}};
  const glm::dmat3 before = motion_covariance(body, pose);
  const glm::dmat3 after = motion_covariance(body, scaled(body, pose, {0.5, 0.1}));
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(after[i][k], 0.5 * before[i][k] + (i == k ? 0.01 : 0.0), 1e-12);
    }
  }
}

}  // namespace palpate::left_out_fit_test
