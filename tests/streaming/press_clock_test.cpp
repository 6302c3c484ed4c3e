// The offset between the clocks of presses and poses, where presses show it, and what an import
// knows of its readings.

#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>

#include "streaming/import_steps.hpp"
#include "streaming/press_clock.hpp"
#include "support/limits.hpp"

namespace palpate::press_clock_test {

/// Uniform over [0, 1).
double part(std::mt19937& random) { return random() / 4294967296.0; }

/// How a robot presses again and again.
struct Habit {
  int presses = 20;
  double travel_s = 0.4;      ///< from place to place
  double rest_s = 0.0;        ///< before and after a press, at its place
  double step_mm = 8.0;       ///< between the places
  double lift_mm = 0.0;       ///< while it travels
  double slide_mm_per_s = 0;  ///< while it presses
  bool regular = false;       ///< each press lasts as long
};

/// Frames and poses of such presses, each by a clock of its own.
struct Logs {
  explicit Logs(const Habit& habit, double delay_s = 0.0) {
    std::mt19937 random(7);
    double place_mm = 0.0;
    double at_s = 100.0;
    const auto phase = [&](double seconds, double to_mm, double lifted_mm, float pressure) {
      const double from_mm = place_mm;
      constexpr double step_s = 0.01;
      const int steps = static_cast<int>(std::lround(seconds / step_s));
      for (int k = 0; k < steps; ++k, at_s += step_s) {
        place_mm = from_mm + (to_mm - from_mm) * (k + 1) / steps;
        time_s.push_back(at_s);
        load.push_back(pressure + static_cast<float>(0.3 * part(random)));
        pose_time_s.push_back(at_s + delay_s);
        poses.push_back({{place_mm, 5.0}, 0.2});
        height_mm.push_back(lifted_mm);
      }
    };
    for (int k = 0; k < habit.presses; ++k) {
      const double press_s = habit.regular ? 0.6 : 0.4 + 0.6 * part(random);
      phase(habit.travel_s, place_mm + habit.step_mm, habit.lift_mm, 0.0F);
      phase(habit.rest_s, place_mm, 0.0, 0.0F);
      phase(press_s, place_mm + habit.slide_mm_per_s * press_s, 0.0, 10.0F);
      phase(habit.rest_s, place_mm, 0.0, 0.0F);
    }
    phase(habit.travel_s, place_mm + habit.step_mm, habit.lift_mm, 0.0F);
  }

  std::optional<ClockOffset> offset(bool in_space = false) const {
    const PoseLog log{.time_s = pose_time_s,
                      .T_robot_sensor = poses,
                      .height_mm = std::span(height_mm).first(in_space ? height_mm.size() : 0),
                      .largest_gap_s = 0.1};
    return clock_offset(time_s, load, log, 8.0);
  }

  std::vector<double> time_s;
  std::vector<float> load;
  std::vector<double> pose_time_s;
  std::vector<Pose> poses;
  std::vector<double> height_mm;
};

TEST(ClockOffset, IsFoundFromPosesThatStandStillInPresses) {
  for (const double delay_s : {0.62, -0.45, 4.2, 3600.6, -86400.0}) {
    SCOPED_TRACE(delay_s);
    const auto offset = Logs({}, delay_s).offset();
    ASSERT_TRUE(offset);
    // The travels on both sides of a press bound it.
    EXPECT_NEAR(offset->seconds, delay_s, 0.1);
    EXPECT_EQ(offset->presses, 20u);
    EXPECT_GT(offset->against, 6u);
    EXPECT_LE(offset->left, 1u);
  }
  // Of presses once a second, it is the one nearest to 0.
  EXPECT_NEAR(Logs({.regular = true}, 0.3).offset().value().seconds, 0.3, 0.1);
}

TEST(ClockOffset, IsFoundFromHeightsWhereTheArrayIsLiftedAndSetDownAtOnePlace) {
  const Logs logs({.step_mm = 0.0, .lift_mm = 15.0}, 0.62);
  EXPECT_FALSE(logs.offset()) << "in a plane nothing moves";
  EXPECT_NEAR(logs.offset(true).value().seconds, 0.62, 0.1);
}

TEST(ClockOffset, IsNoneWhereTheClocksAgree) {
  for (const Habit& habit : {Habit(), Habit{.rest_s = 0.3}, Habit{.regular = true},
                             Habit{.step_mm = 3.0, .lift_mm = 20.0}}) {
    EXPECT_FALSE(Logs(habit).offset(habit.lift_mm > 0.0));
    EXPECT_FALSE(Logs(habit, 0.03).offset(habit.lift_mm > 0.0));
  }
}

TEST(ClockOffset, IsNoneWherePressesDoNotShowIt) {
  EXPECT_FALSE(Logs({.step_mm = 0.0}, 0.62).offset()) << "the robot stands still";
  EXPECT_FALSE(Logs({.slide_mm_per_s = 20.0}, 0.62).offset()) << "it slides under load";
  EXPECT_FALSE(Logs({.rest_s = 1.0}, 0.4).offset()) << "it rests for longer than the offset";
  EXPECT_FALSE(Logs({.presses = 3}, 0.62).offset()) << "too few presses";
}

TEST(ClockOffset, OfClocksWithoutACommonEpochIsNamedOnlyWhereOneAloneExplainsThePresses) {
  for (const double delay_s : {1.8e9, -1.8e9 + 0.7}) {
    const auto known = Logs({}, delay_s).offset();
    ASSERT_TRUE(known);
    EXPECT_NEAR(known->seconds, delay_s, 0.1);
    EXPECT_FALSE(known->open_s);
    const auto open = Logs({.regular = true}, delay_s).offset();  // one a second
    ASSERT_TRUE(open);
    EXPECT_NEAR(open->seconds, delay_s, 0.1) << "where the logs begin together";
    ASSERT_TRUE(open->open_s);
    EXPECT_NEAR(*open->open_s, 1.0, 0.05);
    const SetupFinding finding = clock_finding(*open, 0.0);
    EXPECT_TRUE(finding.options.empty());
    EXPECT_NE(finding.words.find("but for 1.00 s"), std::string::npos) << finding.words;
  }
}

TEST(ClockOffset, BecomesAFindingThatNamesWhatMendsIt) {
  const SetupFinding finding =
      clock_finding({.seconds = -0.5, .presses = 60, .against = 41, .left = 1}, 0.2);
  EXPECT_EQ(finding.what, "clock");
  EXPECT_EQ(finding.options, std::vector<std::string>{"pose-delay -0.30"});
  EXPECT_NEAR(finding.nats, 40.0 * std::log(19.0), 1e-9);
  EXPECT_EQ(finding.words,
            "the poses' clock seems 0.50 s behind: in 41 of 60 presses the array moves, is lifted, "
            "or has no pose; with `pose-delay -0.30` in 1");
}

using testing::ElementsAre;

ImportSurvey survey(const std::vector<double>& pressure, std::vector<std::uint8_t> valid) {
  Recording recording;
  recording.elements_mm.resize(valid.size());
  recording.pressure = pressure;
  recording.valid = std::move(valid);
  return survey_of(recording);
}

TEST(ImportSurvey, FindsTheLoadAboveTheLeastSoFarAndWholeNumbers) {
  const ImportSurvey found =
      survey({3, 200, nan, 1, 210, nan, 2, 205, nan, 9, nan, nan, 1, 200, nan}, {1, 1, 1});
  EXPECT_THAT(found.load, ElementsAre(0, 10, 5, 8, 0));
  EXPECT_THAT(found.pressed(), ElementsAre(false, true, true, true, false));
  EXPECT_THAT(found.read, ElementsAre(1, 1, 0));
  EXPECT_EQ(found.whole_up_to, 210.0);
}

TEST(ImportSurvey, DeadElementsLoadNothing) {
  const ImportSurvey found = survey({1.0, 0.0, 2.5, 4000.0}, {1, 0});
  EXPECT_THAT(found.load, ElementsAre(0, 1.5F));
  EXPECT_FALSE(found.whole_up_to);
  EXPECT_FALSE(survey({1.0, 99.0}, {1, 1}).whole_up_to) << "pressures may be small whole numbers";
}

}  // namespace palpate::press_clock_test
