// What a survey finds in a recording, and what it suspects: each rule on a file made to show it.

#include "io/recording_survey.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "file_parts.hpp"
#include "palpate/files.hpp"
#include "palpate/simulation.hpp"
#include "support/limits.hpp"
#include "support/scratch_folder.hpp"

namespace palpate::recording_survey_test {

class RecordingSurveyed : public testing::Test {
 protected:
  RecordingSurvey survey(const Recording& recording) const {
    write_recording(folder_ / "r.h5", recording);
    return survey_recording(folder_ / "r.h5");
  }
  std::vector<std::string> suspicions(const Recording& recording) const {
    return suspicions_of(survey(recording));
  }
  /// Expects one suspicion, which holds all of these parts.
  void expect_suspicion(const Recording& recording,
                        std::initializer_list<const char*> parts) const {
    const std::vector<std::string> found = suspicions(recording);
    ASSERT_EQ(found.size(), 1u) << testing::PrintToString(found);
    expect_named(found.front(), parts);
    EXPECT_TRUE(found.front().ends_with(".") || found.front().ends_with("?")) << found.front();
  }
  void expect_sound(const Recording& recording) const {
    EXPECT_EQ(suspicions(recording), std::vector<std::string>{});
  }

  ScratchFolder folder_;
};

// The paper's training touches of a letter: 192 on a grid.
Recording training(double noise_kpa = 0.7) {
  return Simulator(make_shape("A"), {.noise_kpa = noise_kpa}, digitacts_array(), 5)
      .touch(training_grid(), {});
}

// As a stream of frames, one after the other at 100 Hz.
Recording stream() {
  Recording frames = training();
  frames.rows = "frames";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames.time_s[i] = 1.7e9 + 0.01 * static_cast<double>(i);
  }
  return frames;
}

double& reading(Recording& recording, std::size_t row, std::size_t element) {
  return recording.pressure[recording.elements() * row + element];
}

TEST_F(RecordingSurveyed, Ranges) {
  Recording r;
  r.elements_mm = {{-1.0, 0.0}, {1.0, 0.0}, {1.0, 3.0}};
  r.T_robot_sensor = {{{1.0, -2.0}, 0.5}, {{-4.0, 8.0}, -1.5}};
  r.pressure = {0.0, 1.0, 2.0, 9.0, 2.0, 0.5};
  r.time_s = {10.0, 12.5};
  const RecordingSurvey s = survey(r);
  EXPECT_EQ(s.head.rows, 2u);
  EXPECT_EQ(s.head.elements, 3u);
  EXPECT_EQ(s.poses->x_mm.least, -4.0);
  EXPECT_EQ(s.poses->x_mm.most, 1.0);
  EXPECT_EQ(s.poses->y_mm.least, -2.0);
  EXPECT_EQ(s.poses->y_mm.most, 8.0);
  EXPECT_EQ(s.poses->theta_rad.least, -1.5);
  EXPECT_EQ(s.poses->theta_rad.most, 0.5);
  EXPECT_EQ(s.array->x_mm.span(), 2.0);
  EXPECT_EQ(s.array->y_mm.span(), 3.0);
  EXPECT_EQ(s.spacing->nearest_mm.least, 2.0);
  EXPECT_EQ(s.spacing->nearest_mm.most, 3.0);
  EXPECT_EQ(s.spacing->closest, (std::array<std::size_t, 2>{0, 1}));
  EXPECT_EQ(s.pressure.range->least, 0.0);
  EXPECT_EQ(s.pressure.range->most, 9.0);
  EXPECT_EQ(s.pressure.readings.quantile(0.5), 1.0);
  EXPECT_EQ(s.pressure.in_contact, 1u) << "a reading of 2 kPa is not above 2 kPa";
  EXPECT_EQ(s.elapsed_s, 2.5);
}

TEST_F(RecordingSurveyed, ContactIsJudgedAboveTheBaseline) {
  Recording r = stream();
  const std::uint64_t touched = survey(r).pressure.in_contact;
  EXPECT_GT(touched, 100u);
  r.baseline.assign(36, 64.0);
  for (double& pressure : r.pressure) {
    pressure += 64.0;
  }
  EXPECT_EQ(survey(r).pressure.in_contact, touched);
  r.pressure_unit = "raw";
  EXPECT_FALSE(survey(r).threshold);
}

TEST_F(RecordingSurveyed, DeadAndUnknownReadingsDoNotCount) {
  Recording r = stream();
  r.valid.assign(36, 1);
  r.valid[3] = 0;
  r.elements_mm[3] = r.elements_mm[4];
  for (std::size_t i = 0; i < r.size(); ++i) {
    reading(r, i, 3) = 4000.0;
  }
  reading(r, 7, 5) = nan;
  const RecordingSurvey s = survey(r);
  EXPECT_LT(s.pressure.range->most, 100.0);
  EXPECT_EQ(s.pressure.unknown, 1u);
  EXPECT_EQ(s.pressure.elements[3].known, 0u);
  EXPECT_EQ(s.pressure.elements[5].known, r.size() - 1);
  expect_sound(r);
}

TEST_F(RecordingSurveyed, QuantilesAreExactToABin) {
  ReadingHistogram readings;
  for (int k = -1000; k < 3000; ++k) {
    readings.add(0.1 * k);
  }
  // Bins are 1/128 of a number wide.
  EXPECT_NEAR(readings.quantile(0.125), -50.0, 50.0 / 128.0);
  EXPECT_NEAR(readings.quantile(0.5), 100.0, 100.0 / 128.0);
  EXPECT_NEAR(readings.quantile(1.0), 300.0, 300.0 / 128.0);
  EXPECT_EQ(readings.count(-100.0, 300.0), 4000u);
  EXPECT_EQ(readings.occupied(-1e30, -101.0), 0u);
}

TEST_F(RecordingSurveyed, SpacingIsThatOfAllPairs) {
  std::vector<glm::dvec2> places;
  for (int k = 0; k < 400; ++k) {  // on a spiral, in no order
    const double turn = 0.1 * (k * 7 % 400);
    places.emplace_back(turn * std::cos(turn), turn * std::sin(turn));
  }
  std::optional<Extremes> expected;
  for (const glm::dvec2& a : places) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const glm::dvec2& b : places) {
      nearest = &a == &b ? nearest : std::min(nearest, std::hypot(a.x - b.x, a.y - b.y));
    }
    widen(expected, nearest);
  }
  const ElementSpacing spacing = spacing_of(places).value();
  // Two ways to round a square root.
  EXPECT_NEAR(spacing.nearest_mm.least, expected->least, 1e-12);
  EXPECT_NEAR(spacing.nearest_mm.most, expected->most, 1e-12);
  EXPECT_FALSE(spacing_of(std::vector<glm::dvec2>(1)));
}

TEST_F(RecordingSurveyed, SimulatedTouchesAreSound) {
  for (const double noise_kpa : {0.0, 0.7}) {
    SCOPED_TRACE(noise_kpa);
    expect_sound(training(noise_kpa));
    for (const int touches : {3, 9, 40, 200}) {
      for (const char* letter : {"E", "O"}) {
        for (std::uint64_t seed = 0; seed < 2; ++seed) {
          SCOPED_TRACE(testing::Message() << letter << " " << touches << " " << seed);
          expect_sound(
              Simulator(make_shape(letter), {.noise_kpa = noise_kpa}, digitacts_array(), seed)
                  .touch(random_poses(touches, seed), {}));
        }
      }
    }
  }
}

TEST_F(RecordingSurveyed, ElementsInMetres) {
  Recording r = training();
  for (glm::dvec2& place : r.elements_mm) {
    place *= 1e-3;
  }
  expect_suspicion(r, {"0.0136 mm long", "metres"});
}

TEST_F(RecordingSurveyed, ElementsAtOnePlace) {
  Recording r = training();
  r.elements_mm[7] = r.elements_mm[30] + glm::dvec2(0.005, 0.0);
  expect_suspicion(r, {"Elements 7 and 30", "0.005 mm apart"});
}

TEST_F(RecordingSurveyed, ElementsBeyondAMetre) {
  Recording r = training();
  for (glm::dvec2& place : r.elements_mm) {
    place *= 1e3;
  }
  expect_suspicion(r, {"4900 mm", "micrometres"});
}

TEST_F(RecordingSurveyed, PosesInMetres) {
  Recording r = training();
  for (Pose& pose : r.T_robot_sensor) {
    pose.translation_mm = 1e-3 * pose.translation_mm + glm::dvec2(0.6, -0.2);
  }
  expect_suspicion(r, {"0.0204 x 0.0204 mm", "metres"});
  // A sensor that presses one place, on a robot that trembles, feels the same each time.
  for (std::size_t i = 0; i < r.size(); ++i) {
    std::copy_n(r.pressure.begin() + 36 * 70, 36, r.pressure.begin() + 36 * static_cast<int>(i));
    reading(r, i, i % 36) += 0.01;
  }
  expect_sound(r);
}

TEST_F(RecordingSurveyed, AnglesInDegrees) {
  Recording r = training();
  for (Pose& pose : r.T_robot_sensor) {
    pose.theta_rad *= 180.0 / std::numbers::pi;
  }
  expect_suspicion(r, {"330", "degrees"});
}

TEST_F(RecordingSurveyed, AnglesCountedOnOverAFullTurn) {
  Recording r = training();
  for (Pose& pose : r.T_robot_sensor) {
    pose.theta_rad += 1.5 * std::numbers::pi;
  }
  ASSERT_GT(survey(r).poses->theta_rad.most, 7.0 * std::numbers::pi / 3.0);
  expect_sound(r);
}

TEST_F(RecordingSurveyed, ConstantElements) {
  for (const double value : {0.0, 7.25}) {
    Recording r = training();
    for (std::size_t i = 0; i < r.size(); ++i) {
      reading(r, i, 4) = value;
      reading(r, i, 9) = value;
    }
    expect_suspicion(r, {"Elements 4, 9 read", value == 0.0 ? "0 kPa" : "7.25 kPa", "valid"});
  }
  Recording all = training();
  std::fill(all.pressure.begin(), all.pressure.end(), 3.0);
  expect_suspicion(all, {"No element's reading ever changes"});
}

// Quantized readings as of an 8-bit sensor, cut at its largest value.
TEST_F(RecordingSurveyed, SaturatedReadings) {
  Recording r = training();
  r.pressure_unit = "raw";
  for (const auto& [gain, saturates] : {std::pair{8.0, false}, {16.0, true}}) {
    Recording quantized = r;
    for (double& pressure : quantized.pressure) {
      pressure = std::min(255.0, std::round(gain * pressure));
    }
    if (saturates) {
      expect_suspicion(quantized, {"readings are exactly the largest, 255 raw", "saturates"});
    } else {
      expect_sound(quantized);
    }
  }
  for (double& pressure : r.pressure) {
    pressure = pressure > 5.0 ? 1.0 : 0.0;  // switches have one largest value
  }
  expect_sound(r);
}

TEST_F(RecordingSurveyed, NothingInContact) {
  Recording r = training();
  for (double& pressure : r.pressure) {
    pressure *= 1e-3;
  }
  expect_suspicion(r, {"No element is ever in contact", "2 kPa", "pressure_unit"});
  r.pressure_unit = "raw";
  expect_sound(r);
}

TEST_F(RecordingSurveyed, Pascals) {
  Recording r = training();
  for (double& pressure : r.pressure) {
    pressure *= 1e3;
  }
  expect_suspicion(r, {"10000 kPa", "pascals"});
}

TEST_F(RecordingSurveyed, FramesWithoutAPose) {
  Recording r = stream();
  const Pose unknown{{nan, nan}, nan};
  std::fill(r.T_robot_sensor.begin(), r.T_robot_sensor.begin() + 90, unknown);
  expect_sound(r);
  std::fill(r.T_robot_sensor.begin(), r.T_robot_sensor.begin() + 100, unknown);
  expect_suspicion(r, {"100 of 192 frames have no pose"});
  std::fill(r.T_robot_sensor.begin(), r.T_robot_sensor.end(), unknown);
  expect_suspicion(r, {"No frame has a pose"});
}

TEST_F(RecordingSurveyed, TouchesThatAreWrittenAgain) {
  Recording r = training();
  expect_sound(r);
  const auto write_again = [&](std::size_t from, std::size_t to) {
    r.T_robot_sensor[to] = r.T_robot_sensor[from];
    for (std::size_t e = 0; e < r.elements(); ++e) {
      reading(r, to, e) = reading(r, from, e);
    }
  };
  write_again(20, 30);
  write_again(20, 31);
  expect_suspicion(r, {"2 of 192 touches equal an earlier one to the digit"});
  r.T_robot_sensor[30].translation_mm.x += 1e-9;
  reading(r, 31, 35) += 1e-9;
  expect_sound(r);
  r = stream();
  write_again(20, 21);
  expect_sound(r);  // frames of a touch that lasts
}

TEST_F(RecordingSurveyed, Times) {
  Recording r = stream();
  expect_sound(r);
  std::swap(r.time_s[50], r.time_s[51]);
  expect_suspicion(r, {"backwards at 1 row, first at row 51"});
  r = stream();
  for (double& time_s : r.time_s) {
    time_s *= 1e3;
  }
  expect_suspicion(r, {"0.5 s apart", "milliseconds"});
}

TEST_F(RecordingSurveyed, ElementsThatReadNothingOrAreAlwaysTouched) {
  Recording r = stream();
  for (std::size_t i = 0; i < r.size(); ++i) {
    reading(r, i, 11) = nan;
  }
  expect_suspicion(r, {"Element 11 has no known reading"});
  r = stream();
  for (std::size_t i = 0; i < r.size(); ++i) {
    reading(r, i, 20) += 50.0;
  }
  expect_sound(r);  // perhaps an offset
  r.baseline.assign(36, 0.0);
  expect_suspicion(r, {"Element 20 reads more than 2 kPa above the baseline in every frame"});
}

}  // namespace palpate::recording_survey_test
