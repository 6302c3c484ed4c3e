#include "trials.hpp"

#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/simulation.hpp"

namespace palpate::bench::trials_test {

const std::vector<std::string> shapes = {"A", "O"};

/// Index of the training pose at which a touch meets the object, or -1.
int training_pose_of(const Pose& T_object_sensor) {
  const std::vector<Pose> grid = training_grid();
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const glm::dvec2 away_mm = grid[i].translation_mm - T_object_sensor.translation_mm;
    const double turn_rad =
        wrap_angle(grid[i].theta_rad - T_object_sensor.theta_rad, 2.0 * std::numbers::pi);
    // Poses of some 20 mm, rotated and back in double.
    if (std::hypot(away_mm.x, away_mm.y) < 1e-9 && std::abs(turn_rad) < 1e-9) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

TEST(Trials, MeetTheObjectAtTheTrainingPosesEachOnce) {
  for (const Recording& trial : make_trials(shapes, 2, 192, 7)) {
    std::set<int> met;
    for (const Pose& T_robot_sensor : trial.T_robot_sensor) {
      met.insert(training_pose_of(trial.truth->T_object_robot * T_robot_sensor));
    }
    EXPECT_EQ(met.size(), 192U);
    EXPECT_FALSE(met.contains(-1));
  }
}

TEST(Trials, AreOfEveryShapeInItsOwnPoseAndOrder) {
  const std::vector<Recording> trials = make_trials(shapes, 3, 5, 7);
  ASSERT_EQ(trials.size(), 6U);
  std::set<double> angles_rad;
  std::set<int> first_touches;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Truth& truth = *trials[i].truth;
    EXPECT_EQ(truth.object, shapes[i / 3]);
    EXPECT_LE(std::abs(truth.T_object_robot.translation_mm.x), 10.0);
    EXPECT_LE(std::abs(truth.T_object_robot.translation_mm.y), 10.0);
    EXPECT_EQ(trials[i].size(), 5U);
    EXPECT_EQ(trials[i].elements(), 36U);
    angles_rad.insert(truth.T_object_robot.theta_rad);
    first_touches.insert(training_pose_of(truth.T_object_robot * trials[i].T_robot_sensor[0]));
  }
  EXPECT_EQ(angles_rad.size(), 6U);
  EXPECT_GT(first_touches.size(), 1U);
}

TEST(Trials, BeginAlikeHoweverManyThereAre) {
  const std::vector<Recording> few = make_trials(shapes, 1, 3, 7);
  const std::vector<Recording> many = make_trials(shapes, 4, 9, 7);
  for (const auto& [short_one, long_one] :
       {std::pair(few[0], many[0]), std::pair(few[1], many[4])}) {
    EXPECT_EQ(short_one.truth->T_object_robot.theta_rad, long_one.truth->T_object_robot.theta_rad);
    for (std::size_t i = 0; i < short_one.pressure.size(); ++i) {
      EXPECT_EQ(short_one.pressure[i], long_one.pressure[i]);
    }
  }
}

TEST(Trials, OfOneShapeShareItsTestSet) {
  const std::vector<Recording> trials = make_trials(shapes, 2, 192, 7);
  const std::multiset<double> first(trials[0].pressure.begin(), trials[0].pressure.end());
  EXPECT_EQ(first, std::multiset<double>(trials[1].pressure.begin(), trials[1].pressure.end()));
  EXPECT_NE(first, std::multiset<double>(trials[2].pressure.begin(), trials[2].pressure.end()));
}

TEST(Trials, WithNoiseAreTheSameReadingsReportedElsewhere) {
  const SensorPoseNoise noise{.translation_mm = 2.0, .rotation_rad = 0.1};
  const std::vector<Recording> exact = make_trials(shapes, 4, 100, 7);
  const std::vector<Recording> noisy = make_trials(shapes, 4, 100, 7, {.pose_noise = noise});
  glm::dvec2 squares_mm2{0.0, 0.0};
  double squares_rad2 = 0.0;
  std::set<double> turns_rad;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_EQ(exact[i].pressure, noisy[i].pressure);
    EXPECT_EQ(exact[i].truth->T_object_robot.theta_rad, noisy[i].truth->T_object_robot.theta_rad);
    for (std::size_t touch = 0; touch < exact[i].size(); ++touch) {
      const Pose off = inverse(exact[i].T_robot_sensor[touch]) * noisy[i].T_robot_sensor[touch];
      squares_mm2 += off.translation_mm * off.translation_mm;
      squares_rad2 += off.theta_rad * off.theta_rad;
      turns_rad.insert(off.theta_rad);
    }
  }
  // Of 800 draws, a standard deviation is known to 2.5 % (one sigma).
  EXPECT_EQ(turns_rad.size(), 800U);
  EXPECT_NEAR(std::sqrt(squares_mm2.x / 800.0), noise.translation_mm, 0.2);
  EXPECT_NEAR(std::sqrt(squares_mm2.y / 800.0), noise.translation_mm, 0.2);
  EXPECT_NEAR(std::sqrt(squares_rad2 / 800.0), noise.rotation_rad, 0.01);
}

TEST(Trials, OfAnotherKindAreOfTheSameUnknowns) {
  const Recording plain = make_trials(shapes, 1, 30, 7).front();
  TrialTouches how;
  how.sensor.elements_mm = {{0.0, 0.0}, {3.8, 0.0}};
  const Recording other = make_trials(shapes, 1, 30, 7, how).front();
  EXPECT_EQ(other.elements(), 2U);
  EXPECT_EQ(other.truth->T_object_robot.translation_mm, plain.truth->T_object_robot.translation_mm);

  const Recording anywhere = make_trials(shapes, 1, 30, 7, {.at_random_poses = true}).front();
  EXPECT_EQ(training_pose_of(anywhere.truth->T_object_robot * anywhere.T_robot_sensor[0]), -1);
}

TEST(Trials, RefuseMoreTouchesThanThereAreToDraw) {
  EXPECT_THROW(make_trials(shapes, 1, 193, 7), Error);
  EXPECT_THROW(make_trials(shapes, 1, 0, 7), Error);
}

}  // namespace palpate::bench::trials_test
