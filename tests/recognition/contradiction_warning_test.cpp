#include "recognition/warnings.hpp"

#include <cstdlib>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "letters.hpp"
#include "model/displacement_points.hpp"
#include "unknown_of.hpp"

namespace palpate::contradiction_warning_test {

using testing::HasSubstr;

class ContradictionWarning : public testing::Test {
 protected:
  ContradictionWarning() : task_(learned_letters(device_), HistogramOptions{}) {}

  RecognitionStep last_step(const Recording& recording) {
    return recognise(recogniser_, task_, unknown_of(recording), false).last();
  }

  /// The warning, given these surprises.
  std::optional<std::string> said(const Recording& recording, const RecognitionStep& step,
                                  const std::vector<double>& surprises) {
    return touches_contradict(evidence_of(recording.touches(0, recording.size()), task_.contact()),
                              task_, step, surprises);
  }

  Device device_ = Device::open();
  RecognitionTask task_;
  Recogniser recogniser_{device_, task_};
};

/// The length that the warning names, mm.
double length_mm(const std::string& warning) {
  const std::string before = "contradict each other by ";
  return std::strtod(warning.c_str() + warning.find(before) + before.size(), nullptr);
}

Recording misplaced(Recording recording, double mm, std::uint64_t seed) {
  Random random(seed, Stream::pose_noise);
  for (Pose& pose : recording.T_robot_sensor) {
    pose = pose * inverse(random_displacement({.mm = mm, .rad = 0.05 * mm}, random));
  }
  return recording;
}

TEST_F(ContradictionWarning, NamesHowFarTouchesAreMisplaced) {
  int warned = 0;
  double sum_mm = 0.0;
  for (const char* letter : {"A", "E", "I", "O", "U"}) {
    for (const std::string& warning :
         last_step(misplaced(letter_touches(letter, 9, 21), 2.0, 22)).warnings) {
      if (warning.find("contradict") == std::string::npos) {
        continue;  // a wrong pose may lie at the edge of the region
      }
      EXPECT_THAT(warning, HasSubstr(" mm: is touch-sd too small, or did the object move?"));
      ++warned;
      sum_mm += length_mm(warning);
    }
  }
  // 59 of 60 unknowns are warned of at some of 10 touches, and after six touches in ten.
  ASSERT_GE(warned, 2);
  // 2 mm along x and along y are 2.8 mm in all, of which the pose takes a part; 40 unknowns were
  // said to be 1.3 to 2.6 mm apart.
  EXPECT_GT(sum_mm / warned, 1.0);
  EXPECT_LT(sum_mm / warned, 3.0);
}

TEST_F(ContradictionWarning, IsGivenWhereTheObjectMoves) {
  Recording recording = letter_touches("A", 10, 23);
  for (std::size_t i = 5; i < 10; ++i) {
    recording.T_robot_sensor[i] = Pose{{3.0, 0.0}, 0.0} * recording.T_robot_sensor[i];
  }
  bool warned = false;
  for (const RecognitionStep& step :
       recognise(recogniser_, task_, unknown_of(recording), true).trace) {
    for (const std::string& warning : step.warnings) {
      warned = warned || warning.find("contradict each other") != std::string::npos;
    }
  }
  EXPECT_TRUE(warned);
}

TEST_F(ContradictionWarning, NeedsSurprisesOrAMisfit) {
  const Recording recording = letter_touches("E", 6, 24);
  const RecognitionStep step = last_step(recording);
  ASSERT_EQ(step.fit.value().verdict, Verdict::fits);
  EXPECT_FALSE(said(recording, step, {}));
  EXPECT_FALSE(said(recording, step, {9.0, 9.0})) << "two may be chance";
  EXPECT_FALSE(said(recording, step, {9.0, 1.4, 1.4, 1.4})) << "the last three count";
  EXPECT_TRUE(said(recording, step, {0.0, 1.6, 1.6, 1.6}));
  RecognitionStep misfit = step;
  misfit.fit->verdict = Verdict::doubtful;
  EXPECT_TRUE(said(recording, misfit, {}));
  misfit.fit.reset();
  EXPECT_FALSE(said(recording, misfit, {}));
}

TEST_F(ContradictionWarning, IsNotOfOneTouchNorOfParticles) {
  const std::vector<double> surprises(3, 9.0);
  const Recording one = letter_touches("E", 1, 25);
  EXPECT_FALSE(said(one, last_step(one), surprises));
  const Recording recording = letter_touches("E", 6, 25);
  RecognitionStep step = last_step(recording);
  step.refined.reset();
  EXPECT_FALSE(said(recording, step, surprises));
}

TEST_F(ContradictionWarning, IsNotOfTouchesThatFitNowhere) {
  // Every other element in contact is no letter, wherever the touch lies.
  Recording recording = letter_touches("E", 6, 26);
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    recording.pressure[i] = i % 2 == 0 ? 10.0 : 0.0;
  }
  const RecognitionStep step = last_step(recording);
  ASSERT_NE(step.fit.value().verdict, Verdict::fits);
  EXPECT_FALSE(said(recording, step, std::vector<double>(3, 9.0)));
}

}  // namespace palpate::contradiction_warning_test
