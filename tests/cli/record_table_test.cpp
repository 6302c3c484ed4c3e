// What people read of records, from records filled by hand: tables, sentences, the sheet and
// `live`, which all say the same numbers.

#include "cli/record_table.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "cli/sheet.hpp"
#include "cli/step_words.hpp"
#include "cli/text_table.hpp"
#include "palpate/pose_error.hpp"
#include "recognition/label_probability.hpp"
#include "recognition/record_json.hpp"
#include "support/sample_files.hpp"
#include "support/unknown_of.hpp"

namespace palpate::cli::record_table_test {

using testing::HasSubstr;
using testing::Not;

RecognitionTask sample_task(const HistogramOptions& options = {}, bool mirrored = false) {
  std::vector<Hypothesis> maps{{sample_map("A")}, {sample_map("I")}};
  maps[0].map.mirror = maps[0].mirrored = mirrored;
  maps[1].map.symmetry = 2;
  RecognitionTask task(std::move(maps), options);
  task.map_paths = {"A.map.h5", "I.map.h5"};
  return task;
}

/// T_object_robot of an object at `T_robot_object`, known to 0.05 mm, 0.1 mm and 0.01 rad there.
RefinedPose refined_at(const Pose& T_robot_object) {
  const ObjectPose seen =
      inverse(RefinedPose{.T_object_robot = T_robot_object,
                          .covariance = {0.0025, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 1e-4}});
  return {.T_object_robot = seen.T_robot_object, .covariance = seen.covariance};
}

/// An A at x 398.76 mm, y -20.5 mm, theta 0.5 rad, between the bins.
RecognitionRecord sample_record(const std::string& name) {
  RecognitionStep step{.touches = 9,
                       .identity = {0.9876, 0.0124},
                       .mode = {.object = 0,
                                .T_object_robot = inverse(Pose{{399.0, -20.0}, 0.55}),
                                .log_likelihood = -30.0},
                       .refined = refined_at({{398.76, -20.5}, 0.5}),
                       .places = {.share = 0.98}};
  return {
      .recording = "/data/" + name, .frame = {}, .touches = 9, .true_label = {}, .trace = {step}};
}

/// sample_record() with a truth.
RecognitionRecord sample_trial(const std::string& name, const RecognitionTask& task) {
  RecognitionRecord record = sample_record(name);
  RecognitionStep& step = record.trace.back();
  const Pose truth = inverse(Pose{{398.8, -20.4}, 0.51});
  const Body body = body_of(task.hypotheses[0].map);
  record.true_label = "A";
  step.truth = {.label = "A", .T_object_robot = truth};
  step.right = true;
  step.body = body;
  step.error_mm = pose_error_mm(body, 1, step.mode.T_object_robot, truth);
  step.refined_error_mm = pose_error_mm(body, 1, step.refined->T_object_robot, truth);
  return record;
}

TEST(ResultTable, SaysFirstWhetherToActAndBelowWhereElseTheObjectMayBe) {
  RecognitionRecord record = sample_record("mug.h5");
  RecognitionStep& step = record.trace.back();
  step.decision = {.act = false, .because = "11 % of the belief lies elsewhere"};
  step.places.own = 0;
  step.places.modes = {
      {.object = 0, .probability = 0.8},
      {.object = 1, .probability = 0.11, .pose = {{{1.0, -2.0}, 0.5}, {0.04, 0.0, 0.0, 0.0, 0.09}}},
      {.object = 1, .probability = 0.04}};
  EXPECT_EQ(result_table({record}, sample_task()),
            "mug.h5: do not act: 11 % of the belief lies elsewhere\n"
            "recording  touches  best  prob.          x mm          y mm    theta deg\n"
            "mug.h5           9  A     0.988  398.76+-0.05  -20.50+-0.10  28.65+-0.57\n"
            "  or                I     0.110    1.00+-0.20   -2.00+-0.30  28.65+-0.00\n"
            "  mode              A                  399.00        -20.00        31.51\n");
  EXPECT_THAT(result_table({record, record, record, record}, sample_task()),
              testing::StartsWith(
                  "act on 0 of 4 unknowns\n"
                  "recording  touches  act  best  prob.          x mm          y mm    theta deg\n"
                  "mug.h5           9  -    A     0.988  398.76+-0.05  -20.50+-0.10  "
                  "28.65+-0.57\n"));
  RecognitionRecord sure = sample_record("pen.h5");
  sure.trace.back().decision = {.act = true, .because = "A has 98.8 %"};
  EXPECT_THAT(result_table({record, record, record, sure}, sample_task()),
              HasSubstr("\npen.h5           9  act  A     0.988  "));
  const nlohmann::ordered_json json = to_json(step, sample_task());
  EXPECT_EQ(json.begin().key(), "decision");
  EXPECT_EQ(json["modes"].size(), 3U);
  EXPECT_EQ(json["modes"][1]["object"], "I");
  EXPECT_EQ(json["modes"][1]["covariance"][1][1], 0.09);
  const RecognitionTask mirrored = sample_task({}, true);
  EXPECT_THAT(result_table({record}, mirrored), HasSubstr("  A mirrored  0.988"));
  EXPECT_EQ(to_json(step, mirrored)["mode"]["mirrored"], true);
  EXPECT_EQ(to_json(step, mirrored)["modes"][0]["mirrored"], true);
}

TEST(ResultTable, SaysThatTurnsCountAsEqualAndNoDeviationWhereTheBeliefHasNoPeak) {
  RecognitionRecord record = sample_record("mug.h5");
  EXPECT_THAT(result_table({record}, sample_task()), Not(HasSubstr("looks the same")));
  RecognitionRecord folded = record;
  folded.trace.back().symmetry = 2;
  EXPECT_TRUE(result_table({folded}, sample_task())
                  .ends_with("  31.51\nA looks the same after every 1/2 of a turn: its theta is "
                             "given from -90 to 90 deg\n"));
  EXPECT_THAT(result_table({record, folded, folded}, sample_task()),
              HasSubstr("A looks the same after every 1/2 of a turn, as far as the touches of 2 of "
                        "these unknowns tell: their theta is given from -90 to 90 deg\n"));
  record.trace.back().places.peak = false;
  EXPECT_THAT(result_table({record}, sample_task()), Not(HasSubstr("+-")));
}

TEST(ResultTable, GivesThePoseItsOwnShareOfTheBelief) {
  RecognitionRecord record = sample_record("mug.h5");
  RecognitionStep& step = record.trace.back();
  step.identity = {0.4, 0.58, 0.02};
  step.best = 1;
  step.places.share = 0.152;
  const RecognitionTask task = sample_task({.none_weight = 1.0});
  EXPECT_EQ(result_table({record}, task),
            "recording  touches  best    prob.          x mm          y mm    theta deg\n"
            "mug.h5           9  I       0.580\n"
            "  pose              A       0.152  398.76+-0.05  -20.50+-0.10  28.65+-0.57\n"
            "  or                (none)  0.020\n"
            "  mode              A                    399.00        -20.00        31.51\n");
  EXPECT_EQ(identity_words(step, task), "I (58.0 %), pose of A (15.2 % there)");
  LiveTouch touch{.touch = {.T_robot_sensor = Pose{}}, .step = step};
  EXPECT_THAT(live_line(touch, task), HasSubstr("I, pose of A  0.580    0.152 "));
  step.best = 0;
  step.places.share = 0.25;
  EXPECT_EQ(identity_words(step, task), "A (40.0 %, 25.0 % there)");
  EXPECT_THAT(trace_table(record, task), HasSubstr("A     0.400    0.250  398.76"));
  step.places.share = 0.39;
  EXPECT_EQ(identity_words(step, task), "A (40.0 %)") << "all of it lies there";
  step.identity = {0.4, 0.595, 0.005};
  EXPECT_THAT(result_table({record}, task), Not(HasSubstr("(none)")));
}

TEST(Words, OfOneTouchSayThatItCannotTellWhetherTheObjectIsKnown) {
  RecognitionStep step = sample_record("mug.h5").last();
  const auto said = [&](const RecognitionTask& task) {
    return sentences_of(step, task).findings == std::vector<std::string>{
                                                    "one touch cannot tell whether the object is "
                                                    "one of the maps': the odds of (none) are "
                                                    "about the prior's"};
  };
  RecognitionTask with_none = sample_task({.none_weight = 1.0});
  EXPECT_FALSE(said(with_none));
  step.touches = 1;
  EXPECT_TRUE(said(with_none));
  EXPECT_FALSE(said(sample_task()));
  with_none.sensor.fit_scale = FitScale{.stranger_single_touch = SingleFitScale{-8.0, 2.0}};
  EXPECT_FALSE(said(with_none)) << "the sensor model tells";
}

TEST(ResultTable, SaysTheModeAndTheTruthBelow) {
  const RecognitionTask task = sample_task();
  const RecognitionRecord record = sample_trial("mug.h5", task);
  const std::string error = error_text(record.last().refined_error_mm);
  const std::string mode_error = error_text(record.last().error_mm);
  ASSERT_NE(error, mode_error);
  EXPECT_EQ(
      result_table({record}, task),
      fmt::format(
          "recording  touches  best  prob.          x mm          y mm    theta deg  error\n"
          "mug.h5           9  A     0.988  398.76+-0.05  -20.50+-0.10  28.65+-0.57\n"
          "  mode              A                  399.00        -20.00        31.51  {0} mm off\n"
          "  truth             A                  398.80        -20.40        29.22  {1} mm off\n"
          "1 of 1 right (100.0 %); mean error of refined poses {1} mm, of modes {0} mm\n",
          mode_error, error));
}

TEST(ResultTable, ShowsOfEqualTruthsTheNearest) {
  const RecognitionTask task = sample_task();
  RecognitionRecord record = sample_trial("mug.h5", task);
  record.trace.back().symmetry = 2;
  const glm::dvec2 c = body_of(task.hypotheses[0].map).centroid_mm;
  std::optional<Pose>& truth = record.trace.back().truth.T_object_robot;
  truth = Pose{2.0 * c, std::numbers::pi} * *truth;  // half a turn about the centroid
  EXPECT_THAT(result_table({record}, task), HasSubstr(" 398.80        -20.40        29.22"));
}

TEST(ResultTable, SaysWhichObjectAWrongOneWasAndWhosePoseItIs) {
  RecognitionRecord record = sample_record("mug.h5");
  record.true_label = "I";
  record.trace.back().truth = {.label = "I", .T_object_robot = {}};
  record.trace.back().right = false;
  const std::string text = result_table({record}, sample_task());
  EXPECT_THAT(text, HasSubstr("\n  truth             I"));
  EXPECT_THAT(text, HasSubstr("wrong object\n0 of 1 right (0.0 %)\n"));
  const Recording touches = sample_unknown("I", {}, 2);
  const RecognitionSheet sheet = sheet_of(record, unknown_of(touches), sample_task(), {});
  EXPECT_EQ(sheet.captions.at(0).text, "truth: I");
  EXPECT_TRUE(sheet.captions.at(0).alarm);
  EXPECT_FALSE(sheet.truth);

  record.trace.back().identity = {0.4, 0.6};
  record.trace.back().best = 1;
  record.trace.back().right = true;
  record.trace.back().places.share = 0.38;
  EXPECT_THAT(result_table({record}, sample_task()),
              testing::AllOf(HasSubstr("  I     0.600\n"),
                             HasSubstr("\n  pose              A     0.380  398.76")));
}

TEST(ResultTable, OfParticlesHasTheModesPoseWithoutADeviation) {
  const RecognitionTask task = sample_task();
  RecognitionRecord record = sample_trial("mug.h5", task);
  record.trace.back().refined.reset();
  record.trace.back().refined_error_mm.reset();
  const std::string error = error_text(record.last().error_mm);
  EXPECT_EQ(result_table({record}, task),
            fmt::format("recording  touches  best  prob.    x mm    y mm  theta deg  error\n"
                        "mug.h5           9  A     0.988  399.00  -20.00      31.51\n"
                        "  truth             A            398.80  -20.40      29.22  {0} mm off\n"
                        "1 of 1 right (100.0 %); mean error of modes {0} mm\n",
                        error));
}

TEST(ResultTable, SaysInASentenceWhatDoesNotFit) {
  std::vector<RecognitionRecord> records{sample_record("a.h5"), sample_record("b.h5"),
                                         sample_record("c.h5"), sample_record("d.h5")};
  records[0].trace.back().fit = {.z = 0.4, .verdict = Verdict::fits};
  records[1].trace.back().fit = {.z = -3.1, .verdict = Verdict::doubtful};
  records[2].trace.back().fit = {.z = -11.2, .verdict = Verdict::does_not_fit};
  records[3].trace.back().fit = {.z = -25.0, .verdict = Verdict::does_not_fit};
  records[3].trace.back().contradicted = true;
  records[3].trace.back().touches = 1;
  const std::string text = result_table(records, sample_task());
  EXPECT_THAT(text, HasSubstr("  theta deg  fit\n"));
  EXPECT_THAT(text, HasSubstr("28.65+-0.57  fits\n"));
  EXPECT_THAT(text, HasSubstr("28.65+-0.57  doubtful\n"));
  EXPECT_THAT(text, HasSubstr("28.65+-0.57  no fit\n"));
  EXPECT_THAT(text, HasSubstr("28.65+-0.57  contradicted\n"));
  EXPECT_THAT(text, HasSubstr("\nc.h5: unlike A: its 9 touches fit 11 standard deviations worse "
                              "than touches of A do\nd.h5: contradicted: "));
  EXPECT_THAT(text, HasSubstr("\nd.h5: unlike A: its touch fits 25 standard deviations worse "
                              "than touches of A do\n"));
  EXPECT_THAT(text, Not(HasSubstr("a.h5: ")));
  EXPECT_THAT(text, Not(HasSubstr("b.h5: ")));
  EXPECT_EQ(to_json(records[3].last(), sample_task())["contradicted"], true);
}

TEST(ResultTable, SaysAWarningOfManyRecordingsOnce) {
  std::vector<RecognitionRecord> records;
  for (int i = 0; i < 500; ++i) {
    records.push_back(sample_record("u" + std::to_string(i) + ".h5"));
    records.back().trace.back().warnings = {"every touch misses every map"};
  }
  records[7].trace.back().warnings.emplace_back("the poses look like metres");
  const std::string text = result_table(records, sample_task());
  EXPECT_TRUE(
      text.ends_with("u0.h5, u1.h5, u2.h5 and 497 more: every touch misses every map\n"
                     "u7.h5: the poses look like metres\n"))
      << text.substr(text.size() - 300);
}

TEST(TraceTable, HasALinePerTouchAndThenTheTruth) {
  const RecognitionTask task = sample_task();
  RecognitionRecord record = sample_trial("mug.h5", task);
  record.trace.push_back(record.trace.back());
  record.trace.front().contradicted = true;
  record.trace.back().fit = {.z = 0.1, .verdict = Verdict::fits};
  const std::string error = error_text(record.last().refined_error_mm);
  EXPECT_EQ(
      trace_table(record, task),
      fmt::format(
          "mug.h5\n"
          "  touch  best  prob.          x mm          y mm    theta deg  error mm  fit\n"
          "      1  A     0.988  398.76+-0.05  -20.50+-0.10  28.65+-0.57      {0}  contradicted\n"
          "      2  A     0.988  398.76+-0.05  -20.50+-0.10  28.65+-0.57      {0}  fits\n"
          "  truth: A at x 398.80 mm, y -20.40 mm, theta 29.22 deg; error {0} mm\n",
          error));
}

// One pose, one error, one truth in JSON, in both tables, on the sheet and in `live`.
TEST(RecordOutput, SaysTheSameNumbersEverywhere) {
  const RecognitionTask task = sample_task();
  RecognitionRecord record = sample_trial("mug.h5", task);
  record.trace.back().fit = {.z = -11.0, .verdict = Verdict::does_not_fit};
  record.trace.back().warnings = {"the poses look like metres"};
  const RecognitionStep& step = record.last();
  const nlohmann::json json = to_json(record, task, "device", false);
  const std::vector<double> pose = json.at("refined").at("T_robot_object");
  const std::vector<double> sd = json.at("refined").at("sd");
  const std::vector<double> truth = json.at("truth").at("T_robot_object");
  EXPECT_EQ(json.at("truth").at("object"), "A");
  for (const auto& [key, pose_of] : {std::pair<const char*, Pose>{"mode", step.mode.T_object_robot},
                                     {"refined", step.refined->T_object_robot}}) {
    EXPECT_EQ(json.at(key).at("x_mm"), pose_of.translation_mm.x);
    EXPECT_EQ(json.at(key).at("y_mm"), pose_of.translation_mm.y);
    EXPECT_EQ(json.at(key).at("theta_rad"), pose_of.theta_rad);
  }
  const std::vector<double> mode = json.at("T_robot_object");
  EXPECT_THAT(mode, testing::Pointwise(testing::DoubleNear(1e-9), {399.0, -20.0, 0.55}));
  for (std::size_t k = 0; k < 9; ++k) {
    EXPECT_EQ(json.at("refined").at("covariance")[k / 3][k % 3], step.refined->covariance[k]);
  }
  EXPECT_EQ(json.at("error_mm"), step.error_mm.value());
  const std::string words =
      pose_words(Pose{{pose[0], pose[1]}, pose[2]}, std::array<double, 3>{sd[0], sd[1], sd[2]});
  EXPECT_EQ(words, "x 398.76 +-0.05 mm, y -20.50 +-0.10 mm, theta 28.65 +-0.57 deg");
  const std::string error = error_text(json.at("refined_error_mm").get<double>());
  const std::string true_words = fmt::format(
      "truth: A at {}; error {} mm", pose_words(Pose{{truth[0], truth[1]}, truth[2]}), error);
  LiveState state;
  state.last = LiveTouch{.touch = {.T_robot_sensor = Pose{}}, .step = step};
  const std::string misfit =
      "unlike A: its 9 touches fit 11 standard deviations worse than touches of A do";
  EXPECT_TRUE(summary(state, {}, task)
                  .starts_with("unlike A (98.8 %): " + words + "\n" + true_words + "\n" + misfit +
                               "\nthe poses look like metres\n"))
      << summary(state, {}, task);
  for (const char* part : {" 398.76+-0.05 ", " -20.50+-0.10 ", " 28.65+-0.57 ", "no fit"}) {
    EXPECT_THAT(live_line(*state.last, task), HasSubstr(part));
  }
  EXPECT_THAT(live_line(*state.last, task), HasSubstr(" " + error + " "));
  const nlohmann::json live = to_json(*state.last, task);
  for (const char* key : {"refined", "truth", "fit", "warnings", "refined_error_mm"}) {
    EXPECT_EQ(live.at(key), json.at(key)) << key;
  }

  const Recording touches = sample_unknown("A", {}, 2);
  const RecognitionSheet sheet = sheet_of(record, unknown_of(touches), task, {});
  EXPECT_EQ(sheet.title, "mug.h5");
  EXPECT_EQ(sheet.result,
            "unlike A (98.8 %): x 398.76 ± 0.05 mm, y -20.50 ± 0.10 mm, theta 28.65 ± 0.57°");
  ASSERT_EQ(sheet.captions.size(), 4u);
  EXPECT_EQ(sheet.captions[0].text,
            "truth: A at x 398.80 mm, y -20.40 mm, theta 29.22°; error " + error + " mm");
  EXPECT_FALSE(sheet.captions[0].alarm);
  EXPECT_EQ(sheet.captions[1].text, misfit);
  EXPECT_TRUE(sheet.captions[1].alarm);
  EXPECT_EQ(sheet.captions[2].text, "the poses look like metres");
  EXPECT_TRUE(sheet.captions[2].alarm);
  EXPECT_THAT(sheet.captions[3].text, HasSubstr("x 399.00 mm, y -20.00 mm, theta 31.51°; error "));
  EXPECT_EQ(sheet.T_object_robot.theta_rad, step.refined->T_object_robot.theta_rad);
}

TEST(Shortened, CountsCharactersNotBytes) {
  EXPECT_EQ(shorten_middle("mug.h5", 6), "mug.h5");
  EXPECT_EQ(shorten_middle("left-hand-mug-000123.h5", 12), "left-...3.h5");
  EXPECT_EQ(shorten_middle("äöüäöü", 6), "äöüäöü");
  EXPECT_EQ(shorten_middle("äöüäöüäöü", 7), "äö...öü");
}

TEST(TextTable, ShowsNoControlCharacter) {
  TextTable table({{"name"}});
  table.add({"a\033[2J\nb"});
  EXPECT_EQ(table.text(), "name\na?[2J?b\n");
}

}  // namespace palpate::cli::record_table_test
