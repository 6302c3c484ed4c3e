#include "slip_run.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "palpate/pose_error.hpp"

namespace palpate::bench::slip_run_test {

const std::vector<std::string> letter = {"E"};
constexpr glm::dvec2 centroid_mm{1.0, -2.0};
constexpr DisplacementSd step{0.3, 0.02};

TEST(SlippingTrial, TouchesTheObjectWhereTheTrialDid) {
  const Recording trial = make_trials(letter, 1, 30, 7).front();
  const SlippingTrial slipping = slipping_trial(trial, centroid_mm, step, 1);
  ASSERT_EQ(slipping.T_object_robot.size(), 30U);
  EXPECT_EQ(slipping.recording.pressure, trial.pressure);
  for (std::size_t i = 0; i < 30; ++i) {
    const Pose was = trial.truth->T_object_robot * trial.T_robot_sensor[i];
    const Pose is = slipping.T_object_robot[i] * slipping.recording.T_robot_sensor[i];
    // Poses of some 20 mm, carried to and fro in double.
    EXPECT_NEAR(was.translation_mm.x, is.translation_mm.x, 1e-12);
    EXPECT_NEAR(was.translation_mm.y, is.translation_mm.y, 1e-12);
  }
}

TEST(SlippingTrial, StepsByTheStandardDeviations) {
  glm::dvec2 squares_mm2{0.0, 0.0};
  double squares_rad2 = 0.0;
  int steps = 0;
  for (const Recording& trial : make_trials(letter, 10, 100, 7)) {
    const SlippingTrial slipping =
        slipping_trial(trial, centroid_mm, step, static_cast<std::uint64_t>(steps));
    const std::vector<Pose>& poses = slipping.T_object_robot;
    for (std::size_t i = 1; i < poses.size(); ++i, ++steps) {
      const Pose moved = poses[i] * inverse(poses[i - 1]);
      const glm::dvec2 of_centroid_mm = moved * centroid_mm - centroid_mm;
      squares_mm2 += of_centroid_mm * of_centroid_mm;
      squares_rad2 += moved.theta_rad * moved.theta_rad;
    }
  }
  // Of 990 steps, a standard deviation is known to 2.2 % (one sigma).
  EXPECT_NEAR(std::sqrt(squares_mm2.x / steps), step.mm, 0.03);
  EXPECT_NEAR(std::sqrt(squares_mm2.y / steps), step.mm, 0.03);
  EXPECT_NEAR(std::sqrt(squares_rad2 / steps), step.rad, 0.002);
}

TEST(SlipRun, AveragesOverTheTouchesThatAreLocated) {
  std::vector<PoseErrors> errors(2);
  errors[0].mode_mm = {1.0, {}, {}};
  errors[1].mode_mm = {3.0, 5.0, {}};
  EXPECT_EQ(mean_mode_errors(errors), (TrialErrors{2.0, 5.0, {}}));
  EXPECT_EQ(mean_mode_errors(errors, 1), (TrialErrors{3.0, 5.0, {}}));
  EXPECT_DOUBLE_EQ(located(errors), 0.5);
}

}  // namespace palpate::bench::slip_run_test
