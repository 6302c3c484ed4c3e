// What people and programs read of a bounded posterior's certificate, from records filled by hand.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/record_table.hpp"
#include "cli/sheet.hpp"
#include "cli/step_words.hpp"
#include "recognition/record_json.hpp"
#include "support/sample_files.hpp"
#include "support/unknown_of.hpp"

namespace palpate::cli::record_certificate_test {

using testing::HasSubstr;
using testing::Not;

RecognitionTask task_with(std::optional<double> budget_s) {
  RecognitionTask task({{sample_map("A")}, {sample_map("I")}},
                       BoundedOptions{.tolerance = 1e-4, .budget_s = budget_s});
  task.map_paths = {"A.map.h5", "I.map.h5"};
  return task;
}

/// A record whose bounds leave so much of the belief unproven.
RecognitionRecord record_of(double dropped_mass, std::vector<ProbabilityInterval> bounds) {
  RecognitionStep step{.identity = {0.62, 0.38},
                       .identity_bounds = std::move(bounds),
                       .certificate = Certificate{.dropped_mass = dropped_mass,
                                                  .blocks_bounded = 70'000,
                                                  .bins_evaluated = 1234},
                       .mode = {.object = 0, .log_likelihood = -30.0},
                       .places = {.share = 0.98}};
  return {.recording = "/data/mug.h5", .frame = {}, .touches = 2, .trace = {step, step}};
}

/// The first sentence of findings; "" where there is none.
std::string unproven_sentence(const RecognitionStep& step, const RecognitionTask& task) {
  const StepSentences words = sentences_of(step, task);
  return words.findings.empty() ? "" : words.findings.front();
}

TEST(DroppedText, RoundsUpToOneDigit) {
  const auto text = [](double mass) { return dropped_text(record_of(mass, {{}, {}}).last()); };
  EXPECT_EQ(text(0.0), "0");
  EXPECT_EQ(text(1e-6), "1e-06");
  EXPECT_EQ(text(2.01e-7), "3e-07");
  EXPECT_EQ(text(9.3e-8), "1e-07");
  EXPECT_EQ(text(0.05), "0.05");
  EXPECT_EQ(text(0.97), "1");
  EXPECT_EQ(text(1.0), "1");
  for (double mass = 1e-9; mass <= 1.0; mass *= 1.37) {
    EXPECT_GE(std::stod(text(mass)), mass * (1.0 - 1e-9));
    EXPECT_LE(std::stod(text(mass)), 2.0 * mass);
  }
  EXPECT_EQ(dropped_text(RecognitionStep{}), "") << "of another filter";
}

TEST(UnprovenSentence, SaysTheBoundsAndWhatEndedTheSearch) {
  const auto poor_fits = [](std::int64_t bins) {
    return RecognitionTask({{sample_map("A")}, {sample_map("I")}},
                           BoundedOptions{.poor_bins = bins});
  };
  const RecognitionTask histogram({{sample_map("A")}, {sample_map("I")}}, HistogramOptions{});
  using Bounds = std::vector<ProbabilityInterval>;
  const Bounds wide{{0.0313, 0.99997}, {0.00003, 0.9687}};
  const Bounds sure{{1.0, 1.0}, {0.0, 0.0}};
  const std::tuple<double, Bounds, RecognitionTask, const char*> cases[] = {
      {0.9697, wide, task_with(0.1),
       "(at least 3.1 %, at most 100.0 %): the budget of 100 ms left 97 % of the belief unproven"},
      {0.0123, Bounds{{0.6, 0.65}, {0.35, 0.4}}, task_with({}),
       "(at least 60.0 %, at most 65.0 %): rounding left 1.2 % of the belief unproven"},
      {1e-7, Bounds{{0.1, 0.99}, {0.0, 0.1}}, task_with(0.1),
       "(at least 10.0 %, at most 99.0 %): the budget of 100 ms left the probability of (none) "
       "unproven"},
      {0.37, sure, task_with({}),
       "(at least 100.0 %, at most 100.0 %): rounding left 37 % of the belief unproven"},
      {2.3e-6, sure, poor_fits(1234),
       "(at least 100.0 %, at most 100.0 %): the search, which met nothing but poor fits, left "
       "0.00023 % of the belief unproven"},
      {2.3e-6, sure, poor_fits(1235),
       "(at least 100.0 %, at most 100.0 %): rounding left 0.00023 % of the belief unproven"}};
  for (const auto& [dropped, bounds, task, words] : cases) {
    EXPECT_EQ(unproven_sentence(record_of(dropped, bounds).last(), task),
              std::string("A 62.0 % ") + words);
  }
  const RecognitionRecord proven = record_of(1e-4, {{0.6, 0.64}, {0.36, 0.4}});
  EXPECT_EQ(unproven_sentence(proven.last(), task_with(0.1)), "") << "the tolerance holds";
  EXPECT_EQ(unproven_sentence(record_of(0.9697, wide).last(), histogram), "");
}

TEST(Certificate, IsSaidWhereProbabilitiesAre) {
  const RecognitionTask task = task_with(0.1);
  const RecognitionRecord wide = record_of(0.97, {{0.03, 1.0}, {0.0, 0.97}});
  const std::string sentence = unproven_sentence(wide.last(), task);
  const std::string table = result_table({wide}, task);
  EXPECT_THAT(table, HasSubstr("prob.  dropped"));
  EXPECT_THAT(table, HasSubstr("0.620        1"));
  EXPECT_THAT(table, HasSubstr("mug.h5: " + sentence + "\n"));
  EXPECT_THAT(trace_table(wide, task), HasSubstr("0.620        1"));

  LiveState state;
  state.touches = 2;
  LiveTouch& touch = state.last.emplace();
  touch.touch.T_robot_sensor = Pose{};
  touch.step = wide.last();
  EXPECT_THAT(summary(state, {}, task), HasSubstr("\n" + sentence + "\n"));
  EXPECT_THAT(live_heading(task), HasSubstr("prob.  dropped"));
  EXPECT_THAT(live_line(*state.last, task), HasSubstr("0.620        1"));
  const std::string heading = live_heading(task);
  EXPECT_EQ(live_line(*state.last, task).find(" 0.00 "), heading.find("x mm") - 1)
      << "columns stand below their names\n"
      << heading;

  const Recording touches = sample_unknown("A", {}, 2);
  const RecognitionSheet sheet = sheet_of(wide, unknown_of(touches), task, {});
  const auto caption =
      std::ranges::find(sheet.captions, sentence, &RecognitionSheet::Caption::text);
  ASSERT_NE(caption, sheet.captions.end());
  EXPECT_TRUE(caption->alarm);

  const RecognitionRecord narrow = record_of(2e-7, {{0.62, 0.62}, {0.38, 0.38}});
  EXPECT_THAT(result_table({narrow}, task), HasSubstr("0.620    2e-07"));
  EXPECT_THAT(result_table({narrow}, task), Not(HasSubstr("unproven")));
  EXPECT_EQ(sheet_of(narrow, unknown_of(touches), task, {}).captions.size() + 1,
            sheet.captions.size());
}

TEST(Certificate, IsInTheJson) {
  const RecognitionTask task = task_with(0.1);
  RecognitionRecord record = record_of(0.97, {{0.03, 1.0}, {0.0, 0.97}});
  const nlohmann::json json = to_json(record, task, "a device", true);
  for (const nlohmann::json& step : {json, json["trace"][0]}) {
    EXPECT_EQ(step["dropped_mass"], 0.97);
    EXPECT_EQ(step["identity_bounds"], nlohmann::json({{"A", {0.03, 1.0}}, {"I", {0.0, 0.97}}}));
    EXPECT_EQ(step["bins_evaluated"], 1234);
    EXPECT_EQ(step["blocks_bounded"], 70'000);
    EXPECT_EQ(step["mode_certain"], false);
  }
  record.trace.back().certificate.reset();
  EXPECT_FALSE(to_json(record.last(), task).contains("dropped_mass"));
}

}  // namespace palpate::cli::record_certificate_test
