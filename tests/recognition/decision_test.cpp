// Where a belief lies, by every filter, what a decision to act asks for, and what it says where it
// is not to; turns of an object that touches do not tell apart.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "estimation/lattice/refinement.hpp"
#include "recognition/belief_modes.hpp"
#include "recognition/decision.hpp"
#include "shapes.hpp"
#include "support/unknown_of.hpp"

namespace palpate::decision_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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

class Places : public testing::Test {
 protected:
  /// The last step of a letter's first touches.
  RecognitionStep step_by(std::size_t filter, std::size_t touches) {
    const RecognitionTask task(shapes(), every_filter()[filter]);
    Recogniser recogniser(shared_device(), task);
    return take_step(recogniser, task, recording.touches(0, touches), unknown_of(recording).truth);
  }

  Recording recording = touched_letter(5);
};

TEST_F(Places, AreTheMassesOfTheFullHistogram) {
  const RecognitionTask task(shapes(), every_filter()[0]);
  for (const std::size_t touches : {1U, 3U, 6U}) {
    Recogniser recogniser(shared_device(), task);
    const RecognitionStep step = take_step(recogniser, task, recording.touches(0, touches), {});
    PoseLattice lattice;
    const auto likely = recogniser.likely_bins(std::vector{0, 1}, 1e-6, lattice);
    double near = 0.0;
    for (const std::size_t object : {0U, 1U}) {
      std::vector<double> shares =
          recogniser.filter().histogram()->log_likelihood(static_cast<int>(object));
      const double top = *std::ranges::max_element(shares);
      double sum = 0.0;
      for (double& share : shares) {
        share = std::exp(share - top);
        sum += share;
      }
      double mass = 0.0;
      for (const auto& [bin, share] : likely[object]) {
        mass += share;
        EXPECT_NEAR(share, shares[static_cast<std::size_t>(bin)] / sum, 1e-6);
        if (static_cast<int>(object) == step.mode.object) {
          const double mm = pose_error_mm(displaced_body(task.hypotheses[object].map),
                                          step.symmetry, step.pose(), lattice.T_object_robot(bin));
          near += mm <= neighbourhood_mm ? step.identity[object] * share : 0.0;
        }
      }
      EXPECT_NEAR(mass, 1.0, 0.01) << "6,400 bins below 1e-6 each";
    }
    EXPECT_NEAR(step.places.share, near, 1e-3) << "which adds bins from 1.5e-7 on";
    double all = 0.0;
    for (const BeliefMode& mode : step.places.modes) {
      all += mode.probability;
      EXPECT_LE(mode.probability, step.identity[static_cast<std::size_t>(mode.object)] + 1e-9);
    }
    EXPECT_LE(all, 1.0 + 1e-9);
    EXPECT_GT(all, 0.5);
    EXPECT_LE(step.places.modes.size(), 5U);
    EXPECT_TRUE(
        std::ranges::is_sorted(step.places.modes, std::greater<>(), &BeliefMode::probability));
  }
}

TEST_F(Places, AreTheSameByBoundsAsByTheHistogram) {
  for (const std::size_t touches : {1U, 2U, 6U}) {
    const RecognitionStep dense = step_by(0, touches);
    const RecognitionStep bounded = step_by(2, touches);
    ASSERT_EQ(bounded.places.modes.size(), dense.places.modes.size());
    for (std::size_t i = 0; i < dense.places.modes.size(); ++i) {
      const BeliefMode& a = dense.places.modes[i];
      const BeliefMode& b = bounded.places.modes[i];
      EXPECT_EQ(a.object, b.object);
      // The histogram rounds in float32.
      EXPECT_NEAR(a.probability, b.probability, 1e-4);
      EXPECT_LT(
          glm::distance(a.pose.T_robot_object.translation_mm, b.pose.T_robot_object.translation_mm),
          1e-2);
    }
    EXPECT_NEAR(dense.places.share, bounded.places.share, 1e-3);
    EXPECT_EQ(dense.places.own, bounded.places.own);
    EXPECT_EQ(dense.decision.act, bounded.decision.act);
  }
}

TEST_F(Places, OfOneLabelWeighAsTheTemperatureHasLabelsWeigh) {
  constexpr double temperature = 2.5;
  // The same touch twice leaves the modes that one touch leaves.
  const std::vector<Touch> twice(2, recording.touch(0));
  for (const std::size_t filter : {0U, 2U}) {
    RecognitionTask task(shapes(), every_filter()[filter]);
    Recogniser recogniser(shared_device(), task);
    const RecognitionStep plain = take_step(recogniser, task, twice, {});
    task.sensor.temperature = temperature - 0.5;
    task.sensor.temperature_growth = 0.5;
    recogniser.reset();
    const RecognitionStep tempered = take_step(recogniser, task, twice, {});
    std::vector<std::pair<double, double>> weights;  // of modes of the pose's object
    for (const BeliefMode& a : plain.places.modes) {
      for (const BeliefMode& b : tempered.places.modes) {
        if (a.object == plain.mode.object && b.object == a.object &&
            a.best.theta_rad == b.best.theta_rad &&
            a.best.translation_mm == b.best.translation_mm) {
          weights.emplace_back(a.probability, b.probability);
        }
      }
    }
    ASSERT_GE(weights.size(), 2U);
    double gained = 0.0;
    for (const auto& [before, now] : weights) {
      gained += now - before;
      const double ratio = before / weights.front().first;
      EXPECT_NEAR(now / weights.front().second, std::pow(ratio, 1.0 / temperature), 1e-6);
    }
    EXPECT_NEAR(gained, 0.0, 1e-5);
    // The bins go with the mode that they are of.
    ASSERT_TRUE(plain.places.own && tempered.places.own);
    EXPECT_NEAR(tempered.places.share / tempered.places.modes[*tempered.places.own].probability,
                plain.places.share / plain.places.modes[*plain.places.own].probability, 0.02);
    EXPECT_LT(tempered.places.share, plain.places.share);
    EXPECT_GT(tempered.places.within_mm.value(), plain.places.within_mm.value());
  }
}

TEST_F(Places, OfAnObjectThatLooksAlikeWhenTurnedAreOneWhicheverHasTheMode) {
  for (const std::size_t filter : {0U, 2U}) {
    const auto modes_of_disc = [&](std::optional<int> suggested) {
      std::vector<Hypothesis> maps = shapes();
      maps[1].map.symmetry = 1;  // a disc, which is not the mode's object
      maps[1].map.suggested_symmetry = suggested;
      RecognitionTask task(maps, every_filter()[filter]);
      task.sensor.temperature = 20.0;  // the disc has a share
      Recogniser recogniser(shared_device(), task);
      const RecognitionStep step = take_step(recogniser, task, recording.touches(0, 1), {});
      EXPECT_EQ(step.mode.object, 0);
      return std::ranges::count(step.places.modes, 1, &BeliefMode::object);
    };
    const auto apart = modes_of_disc({});
    EXPECT_GT(apart, 1);
    EXPECT_LT(modes_of_disc(0), apart);
  }
}

TEST_F(Places, AreNoneBeforeATouchReachesTheBelief) {
  std::ranges::fill(recording.pressure, 0.0);
  RecognitionTask task(shapes(), every_filter()[2]);
  task.auto_pivot = true;
  const RecognitionStep step = last_step(task, recording);
  EXPECT_TRUE(step.places.modes.empty());
  EXPECT_FALSE(step.places.within_mm || step.places.peak);
  EXPECT_FALSE(step.decision.act);
}

TEST_F(Places, OfParticlesAreWhereTheHistogramsAre) {
  const RecognitionStep dense = step_by(0, 6);
  const RecognitionStep particles = step_by(1, 6);
  ASSERT_FALSE(dense.places.modes.empty());
  ASSERT_FALSE(particles.places.modes.empty());
  const BeliefMode& a = dense.places.modes.front();
  const BeliefMode& b = particles.places.modes.front();
  EXPECT_EQ(a.object, b.object);
  EXPECT_GT(b.probability, 0.5);
  // Motion noise of 1 mm and 0.1 rad comes between, and bins of 22.5 degrees.
  EXPECT_LT(pose_error_mm(displaced_body(shapes()[a.object].map), 1, inverse(a.pose.T_robot_object),
                          inverse(b.pose.T_robot_object)),
            3.0);
}

TEST(SymmetryTold, IsTheMapsUnlessTurnsWeighAsTheTemperatureHasThem) {
  OccupancyGrid map{.symmetry = 1, .suggested_symmetry = 2};
  const Axis theta{0.0, 2.0 * std::numbers::pi, 8};
  // A hundredth lies half a turn away, across the end of the circle, too.
  std::vector<double> shares(8);
  shares[7] = 0.99;
  shares[3] = 0.01;
  const auto told = [&](double temperature) {
    return symmetry_told(map, theta, shares, theta.centre(7), temperature);
  };
  EXPECT_EQ(told(1.0), 1);
  // 99^(1 / T) = 19
  EXPECT_EQ(told(std::log(99.0) / std::log(19.0) - 0.01), 1);
  EXPECT_EQ(told(std::log(99.0) / std::log(19.0) + 0.01), 2);
  shares[6] = shares[0] = 0.5;  // nearer than a quarter of a turn
  EXPECT_EQ(told(1.0), 1);
  map.suggested_symmetry = 0;
  EXPECT_EQ(told(1.0), 0) << "all turns look alike";
  map.symmetry = 3;
  EXPECT_EQ(told(9.0), 3) << "as the user says";
}

/// The step after 9 touches of a letter whose map suggests one symmetry and has another; the truth,
/// if any, is turned so far.
RecognitionStep step_of(const std::string& letter, int suggested, int symmetry,
                        std::optional<double> turn_rad) {
  std::vector<Hypothesis> maps = learned_letters();
  OccupancyGrid& map =
      std::ranges::find(maps, letter, [](const Hypothesis& one) { return one.map.label; })->map;
  map.suggested_symmetry = suggested;
  map.symmetry = symmetry;
  Recording recording = letter_touches(letter, 9, 11);
  if (turn_rad) {
    // Turned in the object frame, about the letter's middle.
    recording.truth->T_object_robot = Pose{{}, *turn_rad} * recording.truth->T_object_robot;
  } else {
    recording.truth.reset();
  }
  const RecognitionTask task(maps, HistogramOptions{});
  const RecognitionStep step = last_step(task, recording);
  EXPECT_EQ(task.labels[step.best], letter);
  return step;
}

TEST(TurnWarning, TurnsThatTouchesDoNotTellApartCountAsEqual) {
  const RecognitionStep o = step_of("O", 0, 1, 2.0);
  EXPECT_THAT(o.warnings, ElementsAre(AllOf(HasSubstr("O looks the same after any turn"),
                                            HasSubstr("they count as equal"),
                                            HasSubstr("`symmetry 0`"), HasSubstr("`symmetry 1`"))));
  EXPECT_EQ(o.symmetry, 0);
  EXPECT_LT(*o.error_mm, 1.0);
  EXPECT_LT(*o.refined_error_mm, 1.0);
  EXPECT_EQ(o.T_robot_object().theta_rad, 0.0);
  EXPECT_EQ(o.true_T_robot_object()->theta_rad, 0.0);
  const RecognitionStep i = step_of("I", 2, 1, {});
  EXPECT_THAT(i.warnings, ElementsAre(AllOf(HasSubstr("I looks the same after every 1/2 of a turn"),
                                            HasSubstr("`symmetry 2`"))));
  EXPECT_EQ(i.symmetry, 2);
}

TEST(LeastTurned, ThetaOfSymmetricObjectsLiesWithinOneTurnOfThem) {
  const RecognitionStep plain = step_of("I", 2, 1, 0.0);
  ASSERT_TRUE(plain.refined);
  for (const int n : {2, 4}) {
    RecognitionStep turned = plain;
    turned.symmetry = n;
    const Pose T = turned.T_robot_object();
    EXPECT_LE(std::abs(T.theta_rad), std::numbers::pi / n);
    // The middle of the object stays where it is, and so does the set of its turns.
    const glm::dvec2 middle = turned.body->centroid_mm;
    const Pose given = inverse(plain.pose());
    EXPECT_LT(glm::distance(T * middle, given * middle), 1e-9);
    EXPECT_NEAR(wrap_angle(T.theta_rad - given.theta_rad, 2.0 * std::numbers::pi / n), 0.0, 1e-9);
  }
}

TEST(LeastTurned, CarriesTheCovarianceAsTurningEverySampleDoes) {
  const std::optional<Body> body(Body{.centroid_mm = {3.0, -2.0}, .inertia_mm2 = 1.0});
  const RefinedPose refined{
      .T_object_robot = {{40.0, 10.0}, 2.5},
      .covariance = {0.04, 0.01, 0.002, 0.01, 0.09, 0.001, 0.002, 0.001, 0.01}};
  const glm::dvec3 here(refined.T_object_robot.translation_mm, refined.T_object_robot.theta_rad);
  for (const int symmetry : {2, 0}) {
    const RefinedPose turned = least_turned(body, symmetry, refined);
    EXPECT_NE(turned.T_object_robot.theta_rad, here.z);
    const auto turned_back = [&](const glm::dvec3& at) {
      const Pose pose = inverse(least_turned(body, symmetry, Pose{glm::dvec2(at), at.z}));
      return glm::dvec3(pose.translation_mm, pose.theta_rad);
    };
    // Differences of turned poses near the refined one, along each axis.
    constexpr double step = 1e-7;
    glm::dmat3 jacobian;  // by columns
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 near = here;
      near[axis] += step;
      jacobian[axis] = (turned_back(near) - turned_back(here)) / step;
    }
    const glm::dmat3 expected =
        jacobian * glm::make_mat3(refined.covariance.data()) * glm::transpose(jacobian);
    for (const int i : {0, 1, 3, 4}) {
      EXPECT_NEAR(inverse(turned).covariance[i], expected[i / 3][i % 3], 1e-5) << symmetry;
    }
    EXPECT_NEAR(turned.covariance[8], refined.covariance[8], 1e-12);
  }
}

TEST(TurnWarning, IsSilentWhereTheMapKnowsItsSymmetryOrHasNone) {
  for (const auto& [letter, symmetry] : {std::pair{"O", 0}, {"I", 2}, {"A", 1}}) {
    EXPECT_THAT(step_of(letter, symmetry, symmetry, 2.0).warnings, IsEmpty()) << letter;
  }
}

}  // namespace palpate::decision_test
