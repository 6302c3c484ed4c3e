#include "recognition/recognition_record.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <gmock/gmock.h>
#include <glm/geometric.hpp>

#include "palpate/error.hpp"
#include "palpate/learned_sensor.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/record_json.hpp"
#include "recognition/scales.hpp"
#include "reference/reference.hpp"
#include "shapes.hpp"
#include "support/limits.hpp"
#include "support/touched_shape.hpp"
#include "support/unknown_of.hpp"

namespace palpate::recognition_record_test {

Estimate estimate_of(std::vector<double> identity, int object, const Pose& T_object_robot,
                     double none = 0.0) {
  return {.identity = std::move(identity),
          .none = none,
          .mode = {.object = object, .T_object_robot = T_object_robot}};
}

/// What a record is worth, to be compared bit by bit.
void expect_same(const RecognitionRecord& actual, const RecognitionRecord& expected) {
  ASSERT_EQ(actual.error, "");
  EXPECT_EQ(actual.last().identity, expected.last().identity);
  EXPECT_EQ(actual.last().error_mm, expected.last().error_mm);
  EXPECT_EQ(actual.last().refined_error_mm, expected.last().refined_error_mm);
}

class Recognise : public ByEveryFilter {
 protected:
  RecognitionTask task_{shapes(), filter()};
};

TEST_P(Recognise, MakesABrokenUnknownARecordAndTheOthersAreRight) {
  const Recording letter = touched_letter(4);
  const Recording disc = touched_disc(5);
  Recording unsound = touched_letter(6);
  unsound.T_robot_sensor[3].translation_mm.x = nan;
  const Query unreadable{.recording = "gone.h5", .error = "gone.h5: cannot be read"};
  const std::vector<Query> unknowns{unknown_of(letter),
                                    unknown_of(unsound),
                                    unreadable,
                                    {.recording = "empty"},
                                    unknown_of(disc)};
  Recogniser recogniser(shared_device(), task_);
  for (const bool trace : {false, true}) {
    std::vector<RecognitionRecord> records;
    for (const Query& unknown : unknowns) {
      records.push_back(recognise(recogniser, task_, unknown, trace));
    }
    for (const auto& [good, recording] : {std::pair(0U, &letter), {4U, &disc}}) {
      expect_same(records[good], recognised(task_, *recording, trace));
      const RecognitionStep& step = records[good].last();
      EXPECT_EQ(step.right, true);
      EXPECT_EQ(step.certificate.has_value(), bounded());
      ASSERT_EQ(step.identity_bounds.size(), bounded() ? 2U : 0U);
      for (std::size_t i = 0; i < step.identity_bounds.size(); ++i) {
        const auto [low, high] = step.identity_bounds[i];
        EXPECT_TRUE(low <= step.identity[i] && step.identity[i] <= high);
        // All of the mass that is dropped may be of one label.
        EXPECT_LE(high - low, 2.1e-6) << "twice the tolerance";
      }
      EXPECT_EQ(records[good].trace.size(), trace ? 6U : 1U);
      EXPECT_NO_THROW(records[good].require_steps());
    }
    EXPECT_NE(records[1].error.find("finite"), std::string::npos) << records[1].error;
    EXPECT_TRUE(records[1].trace.empty()) << "none of the touches before the unsound one";
    EXPECT_EQ(records[1].recording, "L");
    EXPECT_EQ(records[2].error, unreadable.error);
    EXPECT_EQ(records[3].error, "empty: no touches");
    EXPECT_THROW(records[3].require_steps(), Error);
  }
}

TEST(RecogniseTrace, EndsWithTheSameBits) {
  const Recording letter = touched_letter(7);
  std::vector<FilterOptions> filters = every_filter();
  auto displaced = std::get<BoundedOptions>(every_filter().back());
  displaced.touch_sd = {1.0, 0.1};
  auto slipping = std::get<HistogramOptions>(every_filter().front());
  slipping.slip_sd = {1.0, 0.1};
  filters.insert(filters.end(), {displaced, slipping});
  for (const FilterOptions& filter : filters) {
    RecognitionTask task(shapes(), filter);
    for (const auto tolerance : {std::optional<double>(), std::optional(1e-3)}) {
      task.trace_tolerance = tolerance;
      Recogniser recogniser(shared_device(), task);
      const RecognitionRecord traced = recognise(recogniser, task, unknown_of(letter), true);
      expect_same(traced, recognise(recogniser, task, unknown_of(letter), false));
      task.drawn_tolerance = tolerance;
      const RecognitionRecord drawn =
          recognise(recogniser, task, unknown_of(letter), true, {}, true);
      expect_same(drawn, traced);
      EXPECT_EQ(drawn.last().touch_fit, traced.last().touch_fit);
      ASSERT_EQ(drawn.trace.size(), traced.trace.size());
      for (std::size_t k = 0; k < drawn.trace.size(); ++k) {
        EXPECT_THAT(drawn.trace[k].identity,
                    testing::Pointwise(testing::DoubleNear(2e-3), traced.trace[k].identity));
      }
      const bool exact_touches = task.touch_sd().none() && task.slip_sd().none();
      if (tolerance && exact_touches && std::holds_alternative<BoundedOptions>(filter)) {
        EXPECT_GT(traced.trace.front().certificate->dropped_mass, 1e-6);
        EXPECT_LE(traced.last().certificate->dropped_mass, 1e-6);
      }
    }
  }
}

TEST(PoseOfAStep, IsScaledByThatOfReadingsAlone) {
  const Recording letter = touched_letter(7);
  constexpr double factor = 0.25;
  const auto widened = [&](const FilterOptions& filter) {
    RecognitionTask task(shapes(), filter);
    const double before = last_step(task, letter).refined->covariance[0];
    task.sensor.pose_scale = PoseScale{.factor = factor};
    return last_step(task, letter).refined->covariance[0] / before;
  };
  const auto exact = std::get<HistogramOptions>(every_filter().front());
  EXPECT_NEAR(widened(exact), factor, 1e-9);
  for (auto sd : {&HistogramOptions::touch_sd, &HistogramOptions::slip_sd}) {
    auto displaced = exact;
    displaced.*sd = {0.5, 0.05};
    EXPECT_GT(widened(displaced), factor + 0.05);
    EXPECT_LE(widened(displaced), 1.0);
  }
}

TEST(Progress, SaysHowFarRecognitionIsAndCanEndIt) {
  const Recording recording = touched_letter(8);
  for (const std::size_t filter : {1U, 2U}) {
    const RecognitionTask task(shapes(), every_filter()[filter]);
    Recogniser recogniser(shared_device(), task);
    for (const bool trace : {false, true}) {
      std::vector<double> touches;
      const RecognitionRecord before =
          recognise(recogniser, task, unknown_of(recording), trace,
                    [&](double fraction) { touches.push_back(std::round(6.0 * fraction)); });
      // Bounds search once for all touches.
      EXPECT_EQ(touches, trace || filter == 1 ? std::vector<double>({1, 2, 3, 4, 5, 6})
                                              : std::vector<double>({6}));
      EXPECT_THROW(recognise(recogniser, task, unknown_of(recording), trace,
                             [](double) { throw std::runtime_error("Ctrl-C"); }),
                   std::runtime_error);
      expect_same(recognise(recogniser, task, unknown_of(recording), trace), before);
    }
  }
}

/// A cross as large as the learned shapes.
bool on_cross(const glm::dvec2& p_mm) {
  const double x = std::abs(p_mm.x);
  const double y = std::abs(p_mm.y);
  return (x < 1.5 && y < 8.0) || (y < 1.5 && x < 8.0);
}

TEST_P(Recognise, SaysWhatFitsAndWhatDoesNot) {
  for (const Recording& learned : {touched_letter(22), touched_disc(23)}) {
    const Fit fit = last_step(task_, learned).fit.value();
    EXPECT_EQ(fit.verdict, Verdict::fits) << learned.path << ", z = " << fit.z;
  }
  Recording cross = touches_of(on_cross, {{1.0, -2.0}, 0.4}, 16, 21);
  const Fit fit = last_step(task_, cross).fit.value();
  EXPECT_EQ(fit.verdict, Verdict::does_not_fit) << "z = " << fit.z;
  std::fill(cross.pressure.begin(), cross.pressure.end(), 2.0);
  EXPECT_FALSE(last_step(task_, cross).fit) << "all at the threshold: nothing is known";
  std::fill(cross.pressure.begin(), cross.pressure.end(), -20.0);  // No Contact
  EXPECT_FALSE(last_step(task_, cross).fit) << "an object out of reach explains such touches";
  cross.pressure.back() = 10.0;
  EXPECT_TRUE(last_step(task_, cross).fit);
}

INSTANTIATE_TEST_SUITE_P(By, Recognise, each_filter, filter_name);

TEST(FitOfAStep, IsOfTheBestLearnedObjectAtThePoseThatIsReportedByTheAveragedLikelihood) {
  const Recording recording = touched_letter(24);
  HistogramOptions filter = std::get<HistogramOptions>(every_filter()[0]);
  filter.none_weight = 1e300;
  filter.contact.gamma = 0.2;
  for (const DisplacementSd& sd : {DisplacementSd{}, {.mm = 1.0, .rad = 0.05}}) {
    filter.touch_sd = sd;
    const RecognitionTask task(shapes(), filter);
    const RecognitionRecord record = recognised(task, recording, true);
    ASSERT_EQ(record.trace.size(), 6U);
    for (std::size_t i = 0; i < 6; ++i) {
      const RecognitionStep& step = record.trace[i];
      EXPECT_EQ(task.labels[step.best], none_label);
      EXPECT_EQ(step.fit.value().z,
                fit_of(recording.touches(0, i + 1), step.refined.value().T_object_robot,
                       task.hypotheses[step.mode.object].map, filter.contact, sd)
                    ->z);
    }
  }
}

TEST(Judge, HoldsNoneForRightWhereNoMapHasTheLabel) {
  const RecognitionTask task(shapes(), HistogramOptions{.none_weight = 1.0});
  const Estimate none = estimate_of({0.1, 0.2}, 1, {}, 0.7);
  EXPECT_EQ(judge(none, {.label = "ring"}, task).right, true);
  EXPECT_EQ(judge(none, {.label = "disc"}, task).right, false);
  EXPECT_EQ(judge(none, {}, task).right, std::nullopt);
  EXPECT_EQ(judge(none, {}, task).identity, (std::vector<double>{0.1, 0.2, 0.7}));
  EXPECT_EQ(judge(estimate_of({0.1, 0.2}, 1, {}, 0.0), {.label = "ring"}, task).right, false);
}

TEST(Judge, ErrsAsTheReferenceSaysWhereTheTruthIsOfTheModesObject) {
  const Pose found{{2.5, -1.0}, 1.9};
  const Pose truth{{-1.0, 3.0}, 5.2};
  std::vector<Hypothesis> two = shapes();
  two[0].map.symmetry = 2;
  const RecognitionTask task(two, HistogramOptions{});
  for (const int object : {0, 1}) {
    const OccupancyGrid& map = two[object].map;
    const auto error_mm = [&](const PartialTruth& of) {
      return judge(estimate_of({0.5, 0.5}, object, found), of, task).error_mm;
    };
    // Sums over 2,000 cells of some 100 mm^2 each, in another order.
    EXPECT_NEAR(error_mm({.label = map.label, .T_object_robot = truth}).value(),
                reference::pose_error_mm(map, found, truth), 1e-9);
    EXPECT_FALSE(error_mm({.label = map.label}));
    EXPECT_FALSE(error_mm({.label = two[1 - object].map.label, .T_object_robot = truth}));
  }
}

TEST(Judge, FindsNoErrorOfAnObjectWithoutABody) {
  std::vector<Hypothesis> empty = shapes();
  empty[0].map.log_odds.assign(empty[0].map.log_odds.size(), -1.0F);
  const RecognitionTask task(empty, HistogramOptions{});
  const RecognitionStep step =
      judge(estimate_of({0.7, 0.3}, 0, {}), {.label = "L", .T_object_robot = Pose{}}, task);
  EXPECT_EQ(step.right, true);
  EXPECT_FALSE(step.error_mm);
}

TEST(TakeStep, JudgesTheRefinedPoseToo) {
  const RecognitionTask task(shapes(), every_filter()[0]);
  const Recording letter = touched_letter(9);
  const RecognitionStep step = last_step(task, letter);
  ASSERT_EQ(step.mode.object, 0);
  const OccupancyGrid& map = task.hypotheses[0].map;
  const Pose& truth = letter.truth->T_object_robot;
  EXPECT_NEAR(*step.error_mm, reference::pose_error_mm(map, step.mode.T_object_robot, truth), 1e-9);
  EXPECT_NEAR(*step.refined_error_mm,
              reference::pose_error_mm(map, step.refined->T_object_robot, truth), 1e-9);
  // Bins of 0.5 mm and 22.5 degrees; touches without noise.
  EXPECT_LT(*step.refined_error_mm, 1.0);
  EXPECT_EQ(step.pose_error_mm(), step.refined_error_mm);
}

TEST(PartialTruth, IsTheTruthOrElseTheObjectThatIsNamed) {
  const PartialTruth named = partial_truth("L", {});
  EXPECT_EQ(named.label, "L");
  EXPECT_FALSE(named.T_object_robot);
  const PartialTruth known = partial_truth("", Truth{.object = "disc", .T_object_robot = {}});
  EXPECT_EQ(known.label, "disc");
  EXPECT_TRUE(known.T_object_robot);
}

TEST(RecordJson, HasFitAndWarningsWhereTheStepHas) {
  RecognitionTask task(shapes(), every_filter()[0]);
  task.map_paths.assign(task.hypotheses.size(), "shape.map.h5");
  RecognitionStep step{.identity = std::vector<double>(task.labels.size()), .mode = {.object = 0}};
  EXPECT_FALSE(to_json(step, task).contains("fit") || to_json(step, task).contains("warnings"));
  step.warnings = {"one", "two"};
  for (const auto& [verdict, text] : {std::pair{Verdict::fits, "fits"},
                                      {Verdict::doubtful, "doubtful"},
                                      {Verdict::does_not_fit, "does not fit"}}) {
    step.fit = {.z = -4.5, .verdict = verdict};
    const nlohmann::json json = to_json(step, task);
    EXPECT_EQ(json.at("fit"), (nlohmann::json{{"z", -4.5}, {"verdict", text}}));
    EXPECT_EQ(json.at("warnings"), (nlohmann::json{"one", "two"}));
  }
}

TEST(ScaledPose, ScalesWhatReadingsTellAndLeavesWhatDisplacementAdds) {
  constexpr double factor = 0.4;
  constexpr double readings_mm2 = 0.3;
  for (const double displacement_mm2 : {0.0, 1.2}) {
    // Of n touches, each of which tells the place with a variance, the belief has an n-th of that.
    for (const int touches : {1, 3, 9}) {
      const double before = (readings_mm2 + displacement_mm2) / touches;
      const double after = (factor * readings_mm2 + displacement_mm2) / touches;
      EXPECT_NEAR(
          belief_factor(factor, before, {.displacement_mm2 = displacement_mm2, .touches = touches}),
          after / before, 1e-9);
    }
  }
  for (const double no_wider : {0.4, 2.5}) {
    EXPECT_EQ(belief_factor(no_wider, 0.1, {.displacement_mm2 = 1.0, .touches = 9}), 1.0);
  }
  // Where an object slips, a belief settles where a touch tells as much as a slip forgets:
  // p^2 = c s for readings of a variance c far above that of a slip, s.
  EXPECT_NEAR(belief_factor(0.25, 1e-2, {.slip_mm2 = 1e-4, .touches = 10'000}), 0.5, 0.01);
}

/// The shapes, of which the letter may lie on its other side.
std::vector<Hypothesis> mirrored_shapes() {
  std::vector<Hypothesis> maps = shapes();
  maps[0].map.mirror = true;
  add_mirror_images(maps);
  return maps;
}

bool on_mirrored_l(const glm::dvec2& p_mm) { return on_letter_l({-p_mm.x, p_mm.y}); }

TEST(Mirror, FindsTheObjectOnItsOtherSide) {
  const Pose T_object_robot{{1.0, -2.0}, 0.7};
  for (const bool mirrored : {false, true}) {
    Recording recording =
        touches_of(mirrored ? on_mirrored_l : on_letter_l, T_object_robot, 12, 31);
    recording.truth = {.object = "L", .T_object_robot = T_object_robot};
    for (const std::size_t filter : {0U, 2U}) {
      const RecognitionTask task(mirrored_shapes(), every_filter()[filter]);
      EXPECT_EQ(task.labels, (std::vector<std::string>{"L", "disc"}));
      const RecognitionStep step = last_step(task, recording);
      EXPECT_EQ(step.right, true);
      EXPECT_EQ(task.hypotheses[step.mode.object].mirrored, mirrored);
      EXPECT_EQ(step.error_mm.has_value(), !mirrored) << "the truth is of the object as learned";
      EXPECT_EQ(step.refined_error_mm.has_value(), !mirrored);
      EXPECT_EQ(step.true_T_robot_object().has_value(), !mirrored);
      EXPECT_EQ(step.fit.value().verdict, Verdict::fits);
      // Bins of 0.5 mm and 22.5 degrees; the image's frame is where the mirrored letter's was.
      EXPECT_LT(glm::distance(step.pose().translation_mm, T_object_robot.translation_mm), 1.0);
      EXPECT_NEAR(step.pose().theta_rad, T_object_robot.theta_rad, 0.2);
    }
  }
}

/// A table of Eq. 7 over a layer, but for the disc's own numbers, which leave more to chance, with
/// features of the disc and a temperature.
LearnedSensor learned_sensor() {
  const ContactModel equation_7{.gamma = 0.1, .prior = 0.2};
  LearnedSensor sensor{.table = LearnedTable{.layer = {.near_mm = 1.0, .far_mm = 3.0}},
                       .temperature = 4.0};
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    for (int i = 0; i < ReadingLayer::nodes; ++i) {
      const double nats = equation_7.log_likelihood(reading, {ReadingLayer::first_node + 0.5 * i});
      sensor.table->shared.push_back(nats);
      sensor.table->objects["disc"].push_back(0.8 * nats);
    }
  }
  sensor.features = {.weight = 0.3,
                     .any = {.mean = {2.0, 4.0, 1.5}, .sd = {1.0, 1.0, 1.0}},
                     .objects = {{"disc", {.mean = {3.0, 5.0, 2.0}, .sd = {0.5, 0.5, 0.5}}}}};
  return sensor;
}

TEST(LearnedSensor, TellsTheSameByBoundsAsByTheHistogram) {
  const LearnedSensor sensor = learned_sensor();
  for (const Recording& recording : {touched_letter(5), touched_disc(6), touched_letter(7)}) {
    std::vector<RecognitionRecord> records;
    for (const std::size_t filter : {0U, 2U}) {
      FilterOptions options = every_filter()[filter];
      std::vector<Hypothesis> maps = mirrored_shapes();
      std::visit([&](auto& of) { apply(sensor, maps, of.contact); }, options);
      RecognitionTask task(maps, with_evidence(options, sensor));
      task.sensor.temperature = sensor.temperature;
      task.sensor.features = sensor.features;
      records.push_back(recognised(task, recording, true));
    }
    for (std::size_t k = 0; k < recording.size(); ++k) {
      const RecognitionStep& bounded = records[1].trace[k];
      ASSERT_EQ(bounded.identity_bounds.size(), 2u);
      for (std::size_t i = 0; i < 2; ++i) {
        const auto [low, high] = bounded.identity_bounds[i];
        // Two log evidences of the histogram, each within 1e-4 nats per touch, over 4.
        const double rounding = 2e-4 * static_cast<double>(k + 1) / 4.0;
        EXPECT_GE(records[0].trace[k].identity[i], low - rounding) << "touch " << k;
        EXPECT_LE(records[0].trace[k].identity[i], high + rounding) << "touch " << k;
        // Each of two log evidences is known within a 20th of the temperature.
        EXPECT_LT(high - low, 0.05);
      }
    }
  }
}

}  // namespace palpate::recognition_record_test
