// Each warning is provoked on purpose, end to end through recognise(), and good touches give none.

#include "recognition/decision.hpp"

#include <cstdio>
#include <memory>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "shapes.hpp"
#include "support/errors.hpp"
#include "support/synthetic.hpp"
#include "support/unknown_of.hpp"

namespace palpate::warnings_test {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using Words = std::vector<std::string>;

class Warnings : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    task_ = std::make_unique<RecognitionTask>(learned_letters(), HistogramOptions{});
    recogniser_ = std::make_unique<Recogniser>(shared_device(), *task_);
  }
  static void TearDownTestSuite() {
    recogniser_.reset();
    task_.reset();
  }

  /// The warnings after all touches of a recording, on the default lattice or by other options.
  static Words warnings(const Recording& recording) {
    return recognise(*recogniser_, *task_, unknown_of(recording), false).last().warnings;
  }
  static Words warnings(const Recording& recording, const FilterOptions& options,
                        const std::vector<Hypothesis>& maps = learned_letters()) {
    return last_step({maps, options}, recording).warnings;
  }
  /// Expects one warning, which has all of these words.
  static void expect_one(const Words& said, std::initializer_list<const char*> parts) {
    ASSERT_EQ(said.size(), 1U) << testing::PrintToString(said);
    expect_named(said.front(), parts);
  }

  static inline std::unique_ptr<RecognitionTask> task_;
  static inline std::unique_ptr<Recogniser> recogniser_;
};

/// Touches of the letter A.
Recording touches(std::uint64_t seed, int count = 9) { return letter_touches("A", count, seed); }

/// Touches of the letter A at changed poses.
template <class Change>
Recording changed(std::uint64_t seed, const Change& change) {
  Recording recording = touches(seed);
  for (Pose& pose : recording.T_robot_sensor) {
    change(pose);
  }
  return recording;
}

/// Good touches of each letter warn after none of them.
void expect_silence(const RecognitionTask& task, std::uint64_t seeds) {
  Recogniser recogniser(shared_device(), task);
  for (const char* letter : {"A", "E", "I", "O", "U"}) {
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const Recording recording = letter_touches(letter, 9, seed);
      const RecognitionRecord record = recognise(recogniser, task, unknown_of(recording), true);
      ASSERT_EQ(record.trace.size(), 9U);
      for (const RecognitionStep& step : record.trace) {
        EXPECT_THAT(step.warnings, IsEmpty())
            << letter << ", seed " << seed << ", after touch " << step.touches;
      }
    }
  }
}

TEST_F(Warnings, GoodTouchesGiveNoneOnTheDefaultLattice) { expect_silence(*task_, 3); }

TEST_F(Warnings, GoodTouchesGiveNoneToParticles) {
  expect_silence({learned_letters(), ParticleOptions{.particles = 2000}}, 1);
}

TEST_F(Warnings, GoodSinglePressesGiveNone) {
  for (const char* letter : {"A", "E", "I", "O", "U"}) {
    const Recording recording = letter_touches(letter, 15, 60);
    for (std::size_t i = 0; i < recording.size(); ++i) {
      const Query press{.recording = letter, .frame = i, .touches = {recording.touch(i)}};
      EXPECT_THAT(recognise(*recogniser_, *task_, press, false).last().warnings, IsEmpty())
          << letter << " " << i;
    }
  }
}

TEST_F(Warnings, TouchesFarFromThePivotMissEveryMap) {
  const Recording recording = moved(touches(1), {{400.0, 200.0}, 0.0});
  // The sensor is 447 mm from the pivot; 14 mm of region, 29 mm of map, 12 mm of its own and 8 mm
  // of the object's place bring it nearer.
  const Words said = warnings(recording);
  expect_one(said, {"no pose of the region brings 9 of 9 touches in", "from the pivot at 0,0 mm",
                    "; give `pivot-mm="});
  EXPECT_THAT(said, ElementsAre(Not(HasSubstr("`x-mm"))));
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
  RecognitionTask task = *task_;
  task.auto_pivot = true;
  Recording recording = touches(1);
  for (const std::size_t i : {1, 3, 5, 7}) {
    recording.T_robot_sensor[i].translation_mm += glm::dvec2(400.0, 200.0);
  }
  EXPECT_THAT(last_step(task, recording).warnings,
              Not(Contains(HasSubstr("no pose of the region"))));
  recording.T_robot_sensor[8].translation_mm += glm::dvec2(400.0, 200.0);
  const Words said = last_step(task, recording).warnings;
  expect_one(said, {"brings 5 of 9 touches in contact", "one object that lay still"});
  EXPECT_THAT(said, ElementsAre(Not(HasSubstr("`pivot"))));
}

TEST_F(Warnings, ARegionBesideEveryMapIsNamedWithOneThatMeetsThem) {
  HistogramOptions options;
  options.lattice.x_mm = {100.0, 120.0, 25};
  expect_one(warnings(touches(1, 3), options),
             {"no pose of the region", "`pivot-mm=", " `x-mm=-", " `y-mm=-"});
}

TEST_F(Warnings, AnObjectOutsideTheRegionIsAtTheEdgeOfAnAxisWithAChoice) {
  const Recording recording = touches(3);
  const Pose& truth = recording.truth->T_object_robot;
  const auto said = [&](Axis PoseLattice::*axis, double lower, double width, int count) {
    HistogramOptions options;
    options.lattice.*axis = {lower, lower + width, count};
    return warnings(recording, options);
  };
  const double x_mm = truth.translation_mm.x + 0.8;
  expect_one(said(&PoseLattice::x_mm, x_mm, 8.0, 10),
             {"at the edge of the region, x = ", fmt::format("of {:.4g} to ", x_mm).c_str(),
              "with `x-mm="});
  expect_one(said(&PoseLattice::y_mm, truth.translation_mm.y + 0.8, 8.0, 10), {"with `y-mm="});
  expect_one(said(&PoseLattice::theta_rad, truth.theta_rad + 0.15, 1.5, 12),
             {"region, theta = ", " degrees of ", "with `theta-deg="});
  HistogramOptions fixed;
  fixed.lattice.x_mm = {truth.translation_mm.x, truth.translation_mm.x, 1};
  fixed.lattice.theta_rad = {truth.theta_rad, truth.theta_rad, 1};
  EXPECT_THAT(warnings(recording, fixed), IsEmpty());
}

TEST_F(Warnings, PositionsInMetres) {
  expect_one(warnings(changed(4,
                              [](Pose& pose) {
                                pose = Pose{{400.0, 200.0}, 0.0} * pose;
                                pose.translation_mm /= 1000.0;
                              })),
             {"positions span 0.0", "mm over 9 touches", "in metres?"});
  // But not presses in one place.
  const Recording one = touches(5, 1);
  Recording presses = one;
  for (int i = 0; i < 4; ++i) {
    presses.pressure.insert(presses.pressure.end(), one.pressure.begin(), one.pressure.end());
    presses.T_robot_sensor.push_back(one.T_robot_sensor.front());
  }
  for (std::size_t i = 0; i < presses.size(); ++i) {
    presses.T_robot_sensor[i].translation_mm = {0.3 + 0.05 * static_cast<double>(i), -0.2};
  }
  EXPECT_THAT(warnings(presses), IsEmpty());
}

TEST_F(Warnings, AnglesInDegrees) {
  constexpr double turn = 2.0 * std::numbers::pi;
  expect_one(warnings(changed(6, [](Pose& pose) { pose.theta_rad *= 360.0 / turn; })),
             {"the sensor's angle is ", " rad at touch ", "in degrees?"});
  // But not where they are counted on over a full turn, nor where `palpate import` interpolates
  // those of a robot that counts from 0 to 2 pi beyond both ends.
  EXPECT_THAT(
      warnings(changed(
          6, [](Pose& pose) { pose.theta_rad = 5.5 + wrap_angle(pose.theta_rad - 5.5, turn); })),
      IsEmpty());
  Recording recording = touches(6);
  double& theta_rad = recording.T_robot_sensor[0].theta_rad;
  theta_rad = wrap_angle(theta_rad, turn);  // in [-pi, pi)
  theta_rad += theta_rad < 0.0 ? -turn : turn;
  EXPECT_THAT(warnings(recording), IsEmpty());
}

TEST_F(Warnings, AnglesOfSeveralTurnsHideNoWarningAboutTouchesThatFit) {
  // A region whose edge lies 0.4 mm short of the object: the best pose fits still.
  const double x_mm = touches(3).truth->T_object_robot.translation_mm.x;
  HistogramOptions options;
  options.lattice.x_mm = {x_mm + 0.4, x_mm + 8.4, 16};
  options.lattice.y_mm.count = 40;
  options.lattice.theta_rad.count = 72;
  const RecognitionTask task(learned_letters(), options);
  const RecognitionStep plain = last_step(task, touches(3));
  ASSERT_EQ(plain.fit->verdict, Verdict::fits) << plain.fit->z;
  ASSERT_THAT(plain.warnings, ElementsAre(HasSubstr("at the edge of the region, x = ")));
  const Recording turned = changed(3, [](Pose& pose) { pose.theta_rad += 6.0 * std::numbers::pi; });
  EXPECT_THAT(last_step(task, turned).warnings,
              ElementsAre(HasSubstr("in degrees?"), HasSubstr("at the edge of the region, x = ")));
}

TEST_F(Warnings, MapsAndArraysOfAnotherUnit) {
  const auto with_maps = [](double factor) {
    std::vector<Hypothesis> maps = learned_letters();
    for (Hypothesis& hypothesis : maps) {
      hypothesis.map.cell_mm *= factor;
      hypothesis.map.origin_mm *= factor;
      *hypothesis.map.spread_mm *= factor;
    }
    return warnings(touches(7), HistogramOptions{}, maps);
  };
  expect_one(with_maps(1e-3),
             {"map 'A' measures 0.0", "less than the 1.9 mm between two elements"});
  expect_one(with_maps(1e3), {"the array measures 14 mm across", "less than one cell of 5e+02 mm"});
  Recording recording = touches(7);
  for (glm::dvec2& element : recording.elements_mm) {
    element /= 1000.0;
  }
  expect_one(warnings(recording),
             {"the array measures 0.014 mm across", "check the unit of the array's elements"});
}

TEST_F(Warnings, ElementsApartOrAloneAreNoScaleAndOneIsNeverOutOfContact) {
  Recording recording = touches(7);
  recording.elements_mm.front() += glm::dvec2(-60.0, -60.0);  // farther than the maps are wide
  EXPECT_THAT(warnings(recording), Not(Contains(HasSubstr("between two elements"))));
  Recording single = touches(7);
  single.pressure.clear();
  for (std::size_t i = 0; i < recording.size(); ++i) {
    single.pressure.push_back(recording.touch(i).pressure[14]);
  }
  single.elements_mm = {recording.elements_mm[14]};
  EXPECT_THAT(warnings(single), IsEmpty());
}

TEST_F(Warnings, BinsThatAreTooCoarse) {
  HistogramOptions options;
  options.lattice.x_mm.count = options.lattice.y_mm.count = options.lattice.theta_rad.count = 10;
  const Words said = warnings(touches(8), options);
  // The cells of A are 8.5 mm from its middle, root mean square: 36 degrees turn them by 5.4 mm,
  // and 54 bins by at most 1 mm.
  expect_one(said, {"is only the width of a bin: ", "theta in bins of 36 degrees",
                    "turn the object by 5.4 mm", "x54` or more, or `bins auto`"});
  options.lattice.pivot_mm = {30.0, -20.0};
  EXPECT_EQ(warnings(moved(touches(8), {{30.0, -20.0}, 0.0}), options), said)
      << "although theta and the translation covary";
}

TEST_F(Warnings, ThresholdsThatLeaveNothingKnown) {
  Recording recording = touches(9);
  const auto with = [&](double threshold, double ratio) {
    HistogramOptions options;
    options.contact.classifier = {.threshold = threshold, .ratio = ratio};
    return warnings(recording, options);
  };
  expect_one(with(1000.0, 0.3), {"ever in contact in 9 touches", "pressures range from 0 to ",
                                 "threshold is 1e+03", "a `threshold` below"});
  expect_one(with(0.0, 0.3),
             {"ever out of contact in 9 touches", "threshold is 0", "a `threshold` above"});
  expect_one(with(1000.0, 0.0),
             {"no element is known to be in contact or out of contact", "a `ratio` above 0"});
  recording.valid.assign(recording.elements(), 0);
  expect_one(with(2.0, 0.3), {"no element is alive"});
}

TEST_F(Warnings, ATouchOrTwoMayMissTheObject) {
  Recording recording = touches(9, 2);
  recording.pressure.assign(recording.pressure.size(), 0.1);
  recording.pressure.front() = 1.0;
  // One element In Contact fits anywhere on the letters.
  EXPECT_THAT(warnings(recording), IsEmpty());
  recording.pressure.assign(recording.pressure.size(), 0.0);  // all Unknown by Eq. 3
  expect_one(warnings(recording),
             {"the touches do not tell the pose: no touch has an element In Contact"});
}

TEST_F(Warnings, ATouchThatDisagreesIsNamed) {
  const auto with_moved = [](std::size_t touch) {
    Recording recording = letter_touches("E", 9, 5);
    // Where the robot says, but of another place.
    recording.T_robot_sensor[touch].translation_mm += glm::dvec2(4.0, -5.0);
    return warnings(recording);
  };
  EXPECT_THAT(warnings(letter_touches("E", 9, 5)), IsEmpty());
  expect_one(with_moved(3), {"touch 4 fits E ", "while the others fit: leave it out"});
  expect_one(with_moved(8), {"touch 9 fits E ", "did the object move, or"});
}

}  // namespace palpate::warnings_test
