// What is said of touches that one pose of a learned object does not explain.

#include "recognition/decision.hpp"

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>

#include <gmock/gmock.h>

#include "model/displacement_points.hpp"
#include "shapes.hpp"
#include "support/shared_device.hpp"
#include "support/unknown_of.hpp"

namespace palpate::placement_judge_test {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// Recognises letters on bins about as wide as the belief, so that letters touched exactly are
/// acted on.
struct LetterRecogniser {
  explicit LetterRecogniser(double touch_sd_mm = 0.0)
      : task(learned_letters(),
             HistogramOptions{
                 .lattice = {{-10.0, 10.0, 40}, {-10.0, 10.0, 40}, {0.0, 6.283185307179586, 120}},
                 .none_weight = 5.0 / 9.0,
                 .touch_sd = {.mm = touch_sd_mm, .rad = 0.05 * touch_sd_mm}}),
        recogniser(shared_device(), task) {
    task.act.below_mm = 1.0;
  }
  RecognitionStep last_step(const Recording& recording) {
    return recognise(recogniser, task, unknown_of(recording), false).last();
  }
  bool holds_for_none(const RecognitionStep& step) const {
    return task.labels[step.best] == none_label;
  }

  RecognitionTask task;
  Recogniser recogniser;
};

class PlacementJudge : public testing::Test {
 protected:
  static void SetUpTestSuite() { letters_ = std::make_unique<LetterRecogniser>(); }
  static void TearDownTestSuite() { letters_.reset(); }

  static inline std::unique_ptr<LetterRecogniser> letters_;
};

Recording misplaced(Recording recording, double mm, std::uint64_t seed) {
  Random random(seed, Stream::pose_noise);
  for (Pose& pose : recording.T_robot_sensor) {
    pose = pose * inverse(random_displacement({.mm = mm, .rad = 0.05 * mm}, random));
  }
  return recording;
}

/// Touches of a letter that moves after some of them, in the robot frame.
Recording moved(std::size_t after, const glm::dvec2& mm) {
  Recording recording = letter_touches("E", 9, 23);
  for (std::size_t i = after; i < recording.size(); ++i) {
    recording.T_robot_sensor[i].translation_mm += mm;
  }
  return recording;
}

/// Nine touches with one of which no element lives before every other touch and at the end.
Recording with_dead_touches(Recording touches) {
  for (const std::ptrdiff_t at : {9, 8, 6, 4, 2, 0}) {
    touches.T_robot_sensor.insert(touches.T_robot_sensor.begin() + at, {{25.0, -40.0}, 1.0});
    touches.pressure.insert(touches.pressure.begin() + at * std::ssize(touches.elements_mm),
                            touches.elements_mm.size(), std::nan(""));
  }
  return touches;
}

TEST_F(PlacementJudge, NamesHowFarTouchesOfALearnedObjectAreMisplaced) {
  int unexplained = 0;
  for (const auto& [letter, seed] : {std::pair{"A", 21U}, {"E", 31U}, {"U", 21U}}) {
    const RecognitionStep step =
        letters_->last_step(misplaced(letter_touches(letter, 9, seed), 1.0, seed + 1));
    unexplained +=
        letters_->holds_for_none(step) || step.fit.value().verdict == Verdict::does_not_fit;
    EXPECT_FALSE(step.decision.act);
    EXPECT_THAT(step.decision.because,
                HasSubstr(std::string("the touches fit ") + letter + " where each lies some "));
    ASSERT_THAT(step.warnings, Contains(HasSubstr(": is touch-sd too small? give `touch-sd-mm ")));
    const std::string& warning = step.warnings.front();
    const double mm = std::stod(warning.substr(warning.find("touch-sd-mm ") + 12));
    EXPECT_GT(mm, 0.4);
    EXPECT_LT(mm, 1.8);
  }
  EXPECT_GE(unexplained, 1) << "else only doubtful fits were explained";
}

TEST_F(PlacementJudge, LeavesStrangersNeverLearned) {
  for (const char* stranger : {"X", "ring"}) {  // by Eq. 7 not every stranger is told
    const RecognitionStep step = letters_->last_step(letter_touches(stranger, 9, 41));
    EXPECT_TRUE(letters_->holds_for_none(step));
    EXPECT_THAT(step.decision.because, HasSubstr("probably never learned"));
  }
}

TEST_F(PlacementJudge, LeavesExactTouchesToBeActedOn) {
  int acts = 0;
  for (const char* letter : {"A", "E", "U"}) {
    const RecognitionStep step = letters_->last_step(letter_touches(letter, 9, 24));
    acts += step.decision.act ? 1 : 0;
    EXPECT_THAT(step.warnings, IsEmpty()) << letter;
  }
  EXPECT_GE(acts, 2);
}

TEST_F(PlacementJudge, SaysAfterWhichTouchAnObjectMovedAndByHowMuch) {
  for (const auto& [mm, turns] : {std::pair{2.0, 0}, {9.0, 0}, {2.0, 2}}) {
    Recording touches = moved(5, {0.6 * mm, 0.8 * mm});
    for (Pose& pose : touches.T_robot_sensor) {
      pose.theta_rad += turns * 2.0 * std::numbers::pi;  // which has a warning of its own
    }
    const RecognitionStep step = letters_->last_step(touches);
    EXPECT_FALSE(step.decision.act);
    EXPECT_THAT(step.decision.because, HasSubstr(" after touch 5")) << mm;
    EXPECT_THAT(step.warnings, Contains(HasSubstr("seems to have moved by ")));
    const std::string& because = step.decision.because;
    EXPECT_NEAR(std::stod(because.substr(because.find("moved by ") + 9)), mm, 0.5);
  }
  EXPECT_THAT(letters_->last_step(with_dead_touches(moved(5, {1.2, 1.6}))).decision.because,
              HasSubstr(" after touch 8"));
}

TEST_F(PlacementJudge, TakesNoMoveFromASingleTouch) {
  for (const std::size_t after : {1, 8}) {  // of nine: one touch fits anywhere
    EXPECT_THAT(letters_->last_step(moved(after, {5.4, 7.2})).warnings,
                Not(Contains(HasSubstr("seems to have moved"))))
        << after;
  }
  EXPECT_THAT(letters_->last_step(with_dead_touches(moved(8, {5.4, 7.2}))).warnings,
              Contains(AllOf(HasSubstr("touch 14 fits"), HasSubstr("did the object move"))));
}

TEST_F(PlacementJudge, TakesTheTouchSdThatIsToldAsExplained) {
  LetterRecogniser told(1.0);
  const RecognitionStep step = told.last_step(misplaced(letter_touches("A", 9, 21), 1.0, 22));
  EXPECT_EQ(told.task.labels[step.best], "A");
  EXPECT_THAT(step.warnings, Not(Contains(HasSubstr("touch-sd"))));
  told.task.act.below_mm = 3.0;  // touches that lie nearer than that are none to warn of
  EXPECT_TRUE(told.last_step(letter_touches("A", 9, 24)).decision.act);
}

TEST_F(PlacementJudge, IsNotOfOneTouchNorOfParticles) {
  const auto judged = [&](const RecognitionStep& step) {
    return judge_placement(letters_->recogniser, letters_->recogniser.estimate(), letters_->task,
                           step)
        .has_value();
  };
  RecognitionStep step = letters_->last_step(moved(5, {9.0, 0.0}));
  ASSERT_TRUE(judged(step));
  step.refined.reset();
  EXPECT_FALSE(judged(step));
  RecognitionStep first = letters_->last_step(letter_touches("A", 1, 21));
  first.best = letters_->task.labels.size() - 1;
  EXPECT_FALSE(judged(first));
}

}  // namespace palpate::placement_judge_test
