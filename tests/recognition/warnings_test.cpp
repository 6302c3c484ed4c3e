// Each warning is provoked on purpose, end to end through recognise(), and good touches give none.

#include "recognition/warnings.hpp"

#include <cstdio>
#include <numbers>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include "letters.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/recognition_record.hpp"
#include "support/sanitized.hpp"
#include "support/unknown_of.hpp"

namespace palpate::warnings_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::vector<std::string> names{"A", "E", "I", "O", "U"};

class Warnings : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    device_ = new Device(Device::open());
    letters_ = new std::vector<Hypothesis>(learned_letters(*device_));
  }
  static void TearDownTestSuite() {
    delete letters_;
    delete device_;
  }

  static RecognitionRecord record_of(const RecognitionTask& task, const Query& unknown,
                                     bool trace = false) {
    Recogniser recogniser(*device_, task);
    return recognise(recogniser, task, unknown, trace);
  }
  /// The warnings after all touches of a recording.
  static std::vector<std::string> warnings(const Recording& recording,
                                           const FilterOptions& options = HistogramOptions{},
                                           const std::vector<Hypothesis>& maps = *letters_) {
    const RecognitionRecord record =
        record_of(RecognitionTask(maps, options), unknown_of(recording));
    EXPECT_EQ(record.error, "");
    return record.trace.empty() ? std::vector<std::string>{} : record.last().warnings;
  }
  /// Expects no warning after any touch. Takes a recogniser: to make one takes longer than to use
  /// it.
  static void expect_silence(Recogniser& recogniser, const RecognitionTask& task,
                             const std::string& letter, int touches, std::uint64_t seed) {
    SCOPED_TRACE(fmt::format("{}, seed {}", letter, seed));
    const Recording recording = letter_touches(letter, touches, seed);
    const RecognitionRecord record = recognise(recogniser, task, unknown_of(recording), true);
    ASSERT_EQ(record.trace.size(), static_cast<std::size_t>(touches));
    for (std::size_t i = 0; i < record.trace.size(); ++i) {
      EXPECT_THAT(record.trace[i].warnings, IsEmpty()) << "after touch " << i + 1;
    }
  }

  static inline Device* device_ = nullptr;
  static inline std::vector<Hypothesis>* letters_ = nullptr;
};

TEST_F(Warnings, GoodTouchesGiveNoneOnTheDefaultLattice) {
  const RecognitionTask task(*letters_, HistogramOptions{});
  Recogniser recogniser(*device_, task);
  for (const std::string& letter : names) {
    for (std::uint64_t seed = 1; seed <= (sanitized ? 2 : 4); ++seed) {
      expect_silence(recogniser, task, letter, 9, seed);
    }
  }
}

TEST_F(Warnings, GoodTouchesGiveNoneOnBinsThatSuitTheMaps) {
  const Recording recording = letter_touches("E", 3, 50);
  HistogramOptions options;
  options.lattice.pivot_mm = recording.T_robot_sensor.front().translation_mm;
  options.lattice = chosen_bins([]() -> Device& { return *device_; }, *letters_,
                                {options, false, ""}, BinWidth::fine)
                        .balanced.lattice;
  const RecognitionTask task(*letters_, options);
  Recogniser recogniser(*device_, task);
  expect_silence(recogniser, task, "E", 3, 50);
}

TEST_F(Warnings, GoodSinglePressesGiveNone) {
  const RecognitionTask task(*letters_, HistogramOptions{});
  Recogniser recogniser(*device_, task);
  for (const std::string& letter : names) {
    const Recording recording = letter_touches(letter, sanitized ? 5 : 20, 60);
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const Query press{.recording = letter, .frame = i, .touches = {recording.touch(i)}};
      EXPECT_THAT(recognise(recogniser, task, press, false).last().warnings, IsEmpty())
          << letter << " " << i;
    }
  }
}

TEST_F(Warnings, GoodTouchesGiveNoneToParticles) {
  const RecognitionTask task(*letters_, ParticleOptions{.particles = 2000});
  Recogniser recogniser(*device_, task);
  for (const std::string& letter : names) {
    expect_silence(recogniser, task, letter, 9, 70);
  }
}

TEST_F(Warnings, TouchesFarFromThePivotMissEveryMap) {
  Recording recording = letter_touches("A", 9, 1);
  for (Pose& pose : recording.T_robot_sensor) {
    pose = Pose{{400.0, 200.0}, 0.0} * pose;
  }
  // The sensor is 447 mm from the pivot; 14 mm of region, 29 mm of map, 12 mm of its own and 8 mm
  // of the object's place bring it nearer.
  const std::vector<std::string> said = warnings(recording);
  ASSERT_THAT(said, ElementsAre(AllOf(HasSubstr("no pose of the region brings 9 of 9 touches in"),
                                      HasSubstr("from the pivot at 0,0 mm"),
                                      HasSubstr("; give `pivot-mm="), Not(HasSubstr("`x-mm")))));
  HistogramOptions remedied;
  const std::string& text = said.front();
  const std::string flag = "`pivot-mm=";
  ASSERT_EQ(std::sscanf(text.c_str() + text.find(flag) + flag.size(), "%lf,%lf",
                        &remedied.lattice.pivot_mm.x, &remedied.lattice.pivot_mm.y),
            2);
  EXPECT_NEAR(remedied.lattice.pivot_mm.x, 400.0, 12.0);
  EXPECT_NEAR(remedied.lattice.pivot_mm.y, 200.0, 12.0);
  EXPECT_THAT(warnings(recording, remedied), IsEmpty());
  EXPECT_THAT(warnings(recording, ParticleOptions{.particles = 100}), said);
}

TEST_F(Warnings, MostTouchesMissTheMapsAboutAnAutomaticPivot) {
  RecognitionTask task(*letters_, HistogramOptions{});
  task.auto_pivot = true;
  Recording recording = letter_touches("A", 9, 1);
  const auto move = [&](std::size_t i) {
    recording.T_robot_sensor[i].translation_mm += glm::dvec2(400.0, 200.0);
  };
  for (const std::size_t i : {1, 3, 5, 7}) {
    move(i);
  }
  EXPECT_THAT(record_of(task, unknown_of(recording)).last().warnings,
              Not(testing::Contains(HasSubstr("no pose of the region"))));
  move(8);
  EXPECT_THAT(record_of(task, unknown_of(recording)).last().warnings,
              ElementsAre(AllOf(HasSubstr("brings 5 of 9 touches in contact"),
                                HasSubstr("one object that lay still"), Not(HasSubstr("`pivot")))));
}

TEST_F(Warnings, ARegionBesideEveryMapIsNamedWithOneThatMeetsThem) {
  HistogramOptions options;
  options.lattice.x_mm = {100.0, 120.0, 25};
  EXPECT_THAT(warnings(letter_touches("A", 3, 1), options),
              ElementsAre(AllOf(HasSubstr("no pose of the region"), HasSubstr("`pivot-mm="),
                                HasSubstr(" `x-mm=-"), HasSubstr(" `y-mm=-"))));
}

TEST_F(Warnings, AnObjectOutsideTheRegionIsAtItsEdge) {
  const Recording recording = letter_touches("A", 9, 3);
  const Pose& truth = recording.truth->T_object_robot;
  const auto beside = [](double at, double width, int count) {
    return Axis{at + 0.1 * width, at + 1.1 * width, count};
  };
  HistogramOptions x;
  x.lattice.x_mm = beside(truth.translation_mm.x, 8.0, 10);
  EXPECT_THAT(warnings(recording, x),
              ElementsAre(AllOf(HasSubstr("at the edge of the region, x = "),
                                HasSubstr(fmt::format("of {:.4g} to ", x.lattice.x_mm.lower)),
                                HasSubstr("with `x-mm="))));
  HistogramOptions y;
  y.lattice.y_mm = beside(truth.translation_mm.y, 8.0, 10);
  EXPECT_THAT(warnings(recording, y), ElementsAre(HasSubstr("with `y-mm=")));
  HistogramOptions theta;
  theta.lattice.theta_rad = beside(truth.theta_rad, 1.5, 12);
  EXPECT_THAT(warnings(recording, theta),
              ElementsAre(AllOf(HasSubstr("region, theta = "), HasSubstr(" degrees of "),
                                HasSubstr("with `theta-deg="))));
}

TEST_F(Warnings, AnAxisWithoutChoiceHasNoEdge) {
  const Recording recording = letter_touches("A", 9, 3);
  const Pose& truth = recording.truth->T_object_robot;
  HistogramOptions options;
  options.lattice.x_mm = {truth.translation_mm.x, truth.translation_mm.x, 1};
  options.lattice.theta_rad = {truth.theta_rad, truth.theta_rad, 1};
  EXPECT_THAT(warnings(recording, options), IsEmpty());
}

TEST_F(Warnings, PositionsInMetres) {
  Recording recording = letter_touches("A", 9, 4);
  for (Pose& pose : recording.T_robot_sensor) {
    pose = Pose{{400.0, 200.0}, 0.0} * pose;
    pose.translation_mm /= 1000.0;
  }
  EXPECT_THAT(warnings(recording),
              ElementsAre(AllOf(HasSubstr("positions span 0.0"), HasSubstr("mm over 9 touches"),
                                HasSubstr("in metres?"))));
}

TEST_F(Warnings, PressesInOnePlaceAreNotInMetres) {
  const Recording one = letter_touches("A", 1, 5);
  Recording presses = one;
  for (int i = 1; i < 5; ++i) {
    presses.pressure.insert(presses.pressure.end(), one.pressure.begin(), one.pressure.end());
    presses.T_robot_sensor.push_back(one.T_robot_sensor.front());
  }
  for (std::size_t i = 0; i < presses.size(); ++i) {
    presses.T_robot_sensor[i].translation_mm = {0.3 + 0.05 * static_cast<double>(i), -0.2};
  }
  EXPECT_THAT(warnings(presses), IsEmpty());
}

TEST_F(Warnings, AnglesInDegrees) {
  Recording recording = letter_touches("A", 9, 6);
  for (Pose& pose : recording.T_robot_sensor) {
    pose.theta_rad *= 180.0 / std::numbers::pi;
  }
  EXPECT_THAT(warnings(recording),
              ElementsAre(AllOf(HasSubstr("the sensor's angle is "), HasSubstr(" rad at touch "),
                                HasSubstr("in degrees?"))));
}

// `palpate import` interpolates the angles of a robot that counts from 0 to 2 pi beyond both ends.
TEST_F(Warnings, AnAngleInterpolatedBeyondAFullTurnIsNotInDegrees) {
  Recording recording = letter_touches("A", 9, 6);
  double& theta_rad = recording.T_robot_sensor[0].theta_rad;
  theta_rad = wrap_angle(theta_rad, 2.0 * std::numbers::pi);  // in [-pi, pi)
  theta_rad += theta_rad < 0.0 ? -2.0 * std::numbers::pi : 2.0 * std::numbers::pi;
  EXPECT_THAT(warnings(recording), IsEmpty());
}

TEST_F(Warnings, AnglesCountedOnOverAFullTurnAreNotInDegrees) {
  Recording recording = letter_touches("A", 9, 6);
  for (Pose& pose : recording.T_robot_sensor) {
    pose.theta_rad = 5.5 + wrap_angle(pose.theta_rad - 5.5, 2.0 * std::numbers::pi);
  }
  EXPECT_THAT(warnings(recording), IsEmpty());
}

TEST_F(Warnings, AnglesOfSeveralTurnsHideNoWarningAboutTouchesThatFit) {
  const auto turned = [](Recording recording) {
    for (Pose& pose : recording.T_robot_sensor) {
      pose.theta_rad += 6.0 * std::numbers::pi;
    }
    return recording;
  };
  // A region whose edge lies 0.4 mm short of the object: the best pose fits still.
  const Recording recording = letter_touches("A", 9, 3);
  const Pose& truth = recording.truth->T_object_robot;
  HistogramOptions options;
  options.lattice.x_mm = {truth.translation_mm.x + 0.4, truth.translation_mm.x + 8.4, 16};
  options.lattice.y_mm.count = 40;
  options.lattice.theta_rad.count = 72;
  const RecognitionTask task(*letters_, options);
  const RecognitionRecord plain = record_of(task, unknown_of(recording));
  ASSERT_EQ(plain.last().fit->verdict, Verdict::fits) << plain.last().fit->z;
  ASSERT_THAT(plain.last().warnings, ElementsAre(HasSubstr("at the edge of the region, x = ")));
  EXPECT_THAT(record_of(task, unknown_of(turned(recording))).last().warnings,
              ElementsAre(HasSubstr("in degrees?"), HasSubstr("at the edge of the region, x = ")));
}

TEST_F(Warnings, MapsAndArraysOfAnotherUnit) {
  const auto scaled = [](double factor) {
    std::vector<Hypothesis> maps = *letters_;
    for (Hypothesis& hypothesis : maps) {
      hypothesis.map.cell_mm *= factor;
      hypothesis.map.origin_mm *= factor;
      *hypothesis.map.spread_mm *= factor;
    }
    return maps;
  };
  Recording recording = letter_touches("A", 9, 7);
  EXPECT_THAT(warnings(recording, HistogramOptions{}, scaled(1e-3)),
              ElementsAre(AllOf(HasSubstr("map 'A' measures 0.0"),
                                HasSubstr("less than the 1.9 mm between two elements"))));
  EXPECT_THAT(warnings(recording, HistogramOptions{}, scaled(1e3)),
              ElementsAre(AllOf(HasSubstr("the array measures 14 mm across"),
                                HasSubstr("less than one cell of 5e+02 mm"))));
  for (glm::dvec2& element : recording.elements_mm) {
    element /= 1000.0;
  }
  EXPECT_THAT(warnings(recording),
              ElementsAre(AllOf(HasSubstr("the array measures 0.014 mm across"),
                                HasSubstr("check the unit of the array's elements"))));
}

TEST_F(Warnings, AnElementThatLiesApartIsNoScale) {
  Recording recording = letter_touches("A", 9, 7);
  recording.elements_mm.front() += glm::dvec2(-60.0, -60.0);  // farther than the maps are wide
  EXPECT_THAT(warnings(recording), Not(testing::Contains(HasSubstr("between two elements"))));
}

TEST_F(Warnings, ASingleElementHasNoScaleAndIsNeverOutOfContact) {
  Recording recording = letter_touches("A", 9, 7);
  std::vector<double> pressure;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    pressure.push_back(recording.touch(i).pressure[14]);
  }
  recording.pressure = pressure;
  recording.elements_mm = {recording.elements_mm[14]};
  EXPECT_THAT(warnings(recording), IsEmpty());
}

TEST_F(Warnings, BinsThatAreTooCoarse) {
  HistogramOptions options;
  options.lattice.x_mm.count = 10;
  options.lattice.y_mm.count = 10;
  options.lattice.theta_rad.count = 10;
  const std::vector<std::string> said = warnings(letter_touches("A", 9, 8), options);
  // The cells of A are 8.5 mm from its middle, root mean square: 36 degrees turn them by 5.4 mm,
  // and 54 bins by at most 1 mm.
  ASSERT_THAT(said, ElementsAre(AllOf(HasSubstr("is only the width of a bin: "),
                                      HasSubstr("theta in bins of 36 degrees"),
                                      HasSubstr("turn the object by 5.4 mm"),
                                      HasSubstr("x54` or more, or `bins auto`"))));
  options.lattice.pivot_mm = {30.0, -20.0};
  Recording moved = letter_touches("A", 9, 8);
  for (Pose& pose : moved.T_robot_sensor) {
    pose.translation_mm += options.lattice.pivot_mm;
  }
  EXPECT_EQ(warnings(moved, options), said) << "although theta and the translation covary";
}

TEST_F(Warnings, ThresholdsThatLeaveNothingKnown) {
  Recording recording = letter_touches("A", 9, 9);
  const auto with = [&](double threshold, double ratio) {
    HistogramOptions options;
    options.contact.classifier = {.threshold = threshold, .ratio = ratio};
    return warnings(recording, options);
  };
  EXPECT_THAT(with(1000.0, 0.3), ElementsAre(AllOf(HasSubstr("ever in contact in 9 touches"),
                                                   HasSubstr("pressures range from 0 to "),
                                                   HasSubstr("threshold is 1e+03"),
                                                   HasSubstr("a `threshold` below"))));
  EXPECT_THAT(with(0.0, 0.3),
              ElementsAre(AllOf(HasSubstr("ever out of contact in 9 touches"),
                                HasSubstr("threshold is 0"), HasSubstr("a `threshold` above"))));
  EXPECT_THAT(with(1000.0, 0.0),
              ElementsAre(AllOf(HasSubstr("no element is known to be in contact or out of contact"),
                                HasSubstr("a `ratio` above 0"))));
  recording.valid.assign(recording.elements(), 0);
  EXPECT_THAT(with(2.0, 0.3), ElementsAre(HasSubstr("no element is alive")));
}

TEST_F(Warnings, ATouchOrTwoMayMissTheObject) {
  Recording recording = letter_touches("A", 2, 9);
  recording.pressure.assign(recording.pressure.size(), 0.1);
  recording.pressure.front() = 1.0;
  // One element In Contact fits anywhere on the letters.
  EXPECT_THAT(warnings(recording), IsEmpty());
  recording.pressure.assign(recording.pressure.size(), 0.0);
  EXPECT_THAT(warnings(recording),
              ElementsAre("the touches do not tell the pose: no touch has an element In Contact"))
      << "where all readings are Unknown by Eq. 3";
}

TEST_F(Warnings, ATouchThatDisagreesIsNamed) {
  const auto said = [](std::vector<std::size_t> moved) {
    Recording recording = letter_touches("E", 9, 5);
    for (const std::size_t touch : moved) {  // where the robot says, but of another place
      recording.T_robot_sensor[touch].translation_mm += glm::dvec2(4.0, -5.0);
    }
    return warnings(recording);
  };
  EXPECT_THAT(said({}), IsEmpty());
  EXPECT_THAT(said({3}), ElementsAre(AllOf(HasSubstr("touch 4 fits E "),
                                           HasSubstr("while the others fit: leave it out"))));
  EXPECT_THAT(said({8}), ElementsAre(AllOf(HasSubstr("touch 9 fits E "),
                                           HasSubstr("did the object move, or"))));
}

}  // namespace palpate::warnings_test
