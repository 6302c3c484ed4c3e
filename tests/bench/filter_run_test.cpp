#include "filter_run.hpp"

#include <gtest/gtest.h>

namespace palpate::bench::filter_run_test {

RecognitionStep step(bool right, double confidence, std::optional<double> error_mm = {},
                     std::optional<double> refined_error_mm = {}) {
  return {.identity = {confidence},
          .right = right,
          .error_mm = error_mm,
          .refined_error_mm = refined_error_mm};
}

FilterRun run_of(const std::vector<std::vector<RecognitionStep>>& trials) {
  FilterRun run;
  for (const std::vector<RecognitionStep>& trace : trials) {
    run.records.push_back({.trace = trace});
  }
  return run;
}

/// Four trials of two touches.
FilterRun small_run() {
  return run_of({{step(true, 0.5, 4.0), step(true, 1.0, 1.0, 0.5)},
                 {step(true, 0.5, 2.0), step(true, 1.0, 2.0, 1.5)},
                 {step(false, 0.3), step(true, 1.0, 6.0, 1.0)},
                 {step(false, 0.3), step(false, 0.6)}});
}

TEST(Curve, CountsTrialsAfterEveryTouch) {
  const std::vector<CurvePoint> curve = curve_of(small_run());
  ASSERT_EQ(curve.size(), 2U);
  EXPECT_EQ(curve[0].touches, 1);
  EXPECT_DOUBLE_EQ(curve[0].accuracy, 0.5);
  EXPECT_DOUBLE_EQ(curve[0].mean_confidence, 0.4);
  EXPECT_EQ(curve[1].touches, 2);
  EXPECT_DOUBLE_EQ(curve[1].accuracy, 0.75);
  EXPECT_DOUBLE_EQ(curve[1].mean_confidence, 0.9);
}

TEST(Curve, TakesErrorsOverTheLocatedTrialsOnly) {
  const std::vector<CurvePoint> curve = curve_of(small_run());
  EXPECT_EQ(curve[0].located, 2);
  EXPECT_FALSE(curve[0].refined_error);
  ASSERT_TRUE(curve[1].error);
  EXPECT_EQ(curve[1].located, 3);
  EXPECT_DOUBLE_EQ(curve[1].error->mean_mm, 3.0);
  EXPECT_DOUBLE_EQ(curve[1].error->median_mm, 2.0);
  EXPECT_DOUBLE_EQ(curve[1].error->p95_mm, 6.0);
  ASSERT_TRUE(curve[1].refined_error);
  EXPECT_DOUBLE_EQ(curve[1].refined_error->mean_mm, 1.0);
}

TEST(Curve, HasNoErrorWhereNothingIsLocated) {
  EXPECT_FALSE(curve_of(run_of({{step(false, 0.3)}})).front().error);
}

TEST(Calibration, ComparesConfidenceWithTheFractionRight) {
  const Calibration calibration = calibration_of(small_run());
  ASSERT_EQ(calibration.bins.size(), 4U) << "from 0.3, 0.5, 0.6 and 0.9, which holds 1";
  EXPECT_EQ(calibration.bins[0].count, 2);
  EXPECT_DOUBLE_EQ(calibration.bins[0].fraction_right, 0.0);
  EXPECT_DOUBLE_EQ(calibration.bins[1].fraction_right, 1.0);
  EXPECT_DOUBLE_EQ(calibration.bins[3].lower, 0.9);
  EXPECT_EQ(calibration.bins[3].count, 3);
  EXPECT_NEAR(calibration.expected_error, (2 * 0.3 + 2 * 0.5 + 1 * 0.6 + 3 * 0.0) / 8.0, 1e-12);
}

TEST(Wilson, BracketsTheFractionAndIsNeverEmpty) {
  // Newcombe 1998, table I: 81 of 263, 15 of 148, 0 of 20 and 1 of 29.
  const auto expect = [](int successes, int trials, double low, double high) {
    const Interval interval = wilson_interval(successes, trials);
    EXPECT_NEAR(interval.low, low, 5e-5) << "to the four digits of the table";
    EXPECT_NEAR(interval.high, high, 5e-5);
  };
  expect(81, 263, 0.2553, 0.3662);
  expect(15, 148, 0.0624, 0.1605);
  expect(0, 20, 0.0, 0.1611);
  expect(1, 29, 0.0061, 0.1718);
  EXPECT_EQ(wilson_interval(20, 20).high, 1.0);
  EXPECT_EQ(curve_of(small_run())[1].accuracy_interval.low, wilson_interval(3, 4).low);
}

TEST(MeanInterval, IsStudents) {
  const Interval few = mean_interval(std::vector{1.0, 2.0, 3.0, 6.0});
  // Mean 3, deviation sqrt(14 / 3), over sqrt(4), times 3.1824 for three degrees of freedom.
  EXPECT_NEAR(few.low, 3.0 - 3.437, 0.04);
  EXPECT_NEAR(few.high, 3.0 + 3.437, 0.04);
  std::vector<double> many;
  for (int i = 0; i < 21; ++i) {
    many.push_back(i);
  }
  // Deviation sqrt(770 / 20), over sqrt(21), times 2.0860 for twenty.
  EXPECT_NEAR(mean_interval(many).high, 10.0 + 2.8244, 1e-3);
}

TEST(Comparison, PairsTrialByTrial) {
  FilterRun other = small_run();
  other.records[0].trace[0].error_mm = 7.0;  // 3 mm behind where both locate
  other.records[1].trace[0].error_mm = {};   // lost: 2 mm of the other do not count
  other.records[2].trace[1].right = false;
  const std::vector<PairedPoint> curve = compare(small_run(), other);
  ASSERT_EQ(curve.size(), 2U);
  EXPECT_EQ(curve[0].right_lead, 0);
  EXPECT_EQ(curve[0].located_by_both, 1);
  ASSERT_TRUE(curve[0].error_lead_mm);
  EXPECT_DOUBLE_EQ(*curve[0].error_lead_mm, 3.0);
  EXPECT_FALSE(curve[0].error_lead_interval) << "one difference says nothing of its spread";
  EXPECT_EQ(curve[1].right_lead, 1);
  EXPECT_EQ(curve[1].located_by_both, 3);
  EXPECT_DOUBLE_EQ(*curve[1].error_lead_mm, 0.0);
  other.records[0].trace[0].error_mm = {};
  EXPECT_FALSE(compare(small_run(), other)[0].error_lead_mm);
}

TEST(Comparison, NamesRangesOfTouches) {
  EXPECT_EQ(ranges_of({}), "");
  EXPECT_EQ(ranges_of({3}), "3");
  EXPECT_EQ(ranges_of({1, 2, 3, 8, 10, 11}), "1-3, 8, 10-11");
}

TEST(Comparison, TakesBalancedBinsForAsMany) {
  EXPECT_TRUE(as_many(9'295, 10'000));
  EXPECT_TRUE(as_many(10'000, 9'295));
  EXPECT_FALSE(as_many(1'000, 10'000));
}

}  // namespace palpate::bench::filter_run_test
