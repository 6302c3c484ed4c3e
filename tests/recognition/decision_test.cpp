// What a decision to act asks for, and what it says where it is not to.

#include <gtest/gtest.h>

#include "recognition/recognition_record.hpp"
#include "shapes.hpp"

namespace palpate::decision_test {

/// A step that a robot acts on, but for what a test changes.
RecognitionStep good_step() {
  return {.identity = {0.999, 0.001},
          .best = 0,
          .fit = Fit{.z = 0.0, .verdict = Verdict::fits},
          .places = {.modes = {{.object = 0, .probability = 0.99}},
                     .own = 0,
                     .share = 0.99,
                     .within_mm = 0.4}};
}

TEST(Decision, IsToActWhereAllIsWell) {
  const RecognitionTask task(shapes(), every_filter()[0]);
  const Decision decision = decide(good_step(), task);
  EXPECT_TRUE(decision.act);
  EXPECT_EQ(
      decision.because,
      "L has more than 99.9 %, and 95 % of the belief lies within 0.40 mm of its pose, if the "
      "touches lie where the robot says");
  auto options = std::get<HistogramOptions>(every_filter()[0]);
  options.touch_sd = {.mm = 0.5, .rad = 0.02};
  EXPECT_EQ(
      decide(good_step(), RecognitionTask(shapes(), options)).because,
      "L has more than 99.9 %, and 95 % of the belief lies within 0.40 mm of its pose, if the "
      "touches lie within some 0.5 mm and 1.1 degrees of where the robot says");
}

TEST(Decision, SaysWhatSpeaksAgainst) {
  auto options = std::get<HistogramOptions>(every_filter()[0]);
  options.none_weight = 1.0;
  RecognitionTask task(shapes(), options);
  const auto refused = [&](const RecognitionStep& step) {
    const Decision decision = decide(step, task);
    EXPECT_FALSE(decision.act);
    return decision.because;
  };
  RecognitionStep step = good_step();
  step.identity = {0.01, 0.01, 0.98};
  step.best = 2;
  EXPECT_EQ(refused(step), "(none) has 98.0 %: the object was probably never learned");

  step.identity = {0.3, 0.21, 0.49};
  EXPECT_EQ(refused(step), "(none) has 49 %: the object was possibly never learned");

  step.identity = {0.0, 0.0, 1.0};
  step.identity_bounds = {{0.0, 1.0}, {0.0, 1.0}, {0.0, 1.0}};
  EXPECT_EQ(refused(step), "(none) has 0 % for certain: the object was possibly never learned");
  step.identity_bounds[2].low = 0.98;
  EXPECT_EQ(refused(step), "(none) has more than 99.9 %: the object was probably never learned");

  step = good_step();
  step.fit->verdict = Verdict::does_not_fit;
  step.fit->z = -6.2;
  EXPECT_EQ(refused(step), "the touches do not fit L, 6 standard deviations worse than its own do");

  step = good_step();
  step.identity = {0.9, 0.1, 0.0};
  EXPECT_EQ(refused(step), "L has 90.0 %, less than 99 %");

  step = good_step();
  step.identity_bounds = {{0.5, 1.0}, {0.0, 0.5}};
  EXPECT_EQ(refused(step), "L has 50 % for certain, less than 99 %");
  step.identity = {0.9, 0.1, 0.0};
  EXPECT_EQ(refused(step), "L has 50 % for certain, less than 99 %");

  step = good_step();
  step.places.modes.push_back({.object = 0, .probability = 0.11, .pose = {{{1.0, -2.0}, 0.5}, {}}});
  step.places.within_mm = 9.9;
  EXPECT_EQ(refused(step),
            "11 % of the belief lies elsewhere: L at x 1.00 mm, y -2.00 mm, theta 28.65 deg");

  std::vector<Hypothesis> sides(2, shapes()[0]);
  sides[1].mirrored = true;
  step.places.modes.back().object = 1;
  EXPECT_EQ(decide(step, RecognitionTask(sides, options)).because,
            "11 % of the belief lies elsewhere: L mirrored at x 1.00 mm, y -2.00 mm, theta 28.65 "
            "deg");

  step = good_step();
  step.places.within_mm = 0.8;
  EXPECT_EQ(refused(step), "95 % of the belief lies within 0.80 mm of the pose, not within 0.5 mm");
  step.places.within_mm = 0.5004;
  EXPECT_EQ(refused(step), "95 % of the belief lies within 0.51 mm of the pose, not within 0.5 mm");
  step.places.within_mm.reset();
  EXPECT_EQ(refused(step), "less than 95 % of the belief is known to lie near the pose of L");

  task.act.above = 0.999999999;
  step = good_step();
  step.identity = {0.99998, 0.00002, 0.0};
  EXPECT_EQ(refused(step), "L has 99.9980 %, less than 99.9999999 %");

  task.act = {.below_mm = 1.0, .above = 0.8};
  step = good_step();
  step.identity = {0.9, 0.1, 0.0};
  step.places.within_mm = 0.9;
  EXPECT_TRUE(decide(step, task).act) << "the task's own costs";
}

}  // namespace palpate::decision_test
