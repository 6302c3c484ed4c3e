#include "trial_errors.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::bench::trial_errors_test {

/// A run with these errors, trial by trial; below 0 where it located nothing.
TrialErrors run_of(const std::vector<double>& errors_mm) {
  TrialErrors run;
  for (const double error_mm : errors_mm) {
    run.push_back(error_mm < 0.0 ? std::nullopt : std::optional(error_mm));
  }
  return run;
}

TEST(ParetoFront, KeepsWhatNothingBeats) {
  const std::vector<CostAndError> entries = {{3.0, 1.0}, {1.0, 5.0}, {2.0, 5.0},
                                             {2.0, 2.0}, {4.0, 1.0}, {3.0, 1.0}};
  EXPECT_EQ(pareto_front(entries), (std::vector<std::size_t>{1, 3, 0}))
      << "by rising cost, the first of equals";
  EXPECT_TRUE(pareto_front({}).empty());
}

TEST(ErrorsOverTrials, LeaveOutTheTrialsWithoutOne) {
  const auto few = errors_over(run_of({1.0, 2.0, 3.0, -1.0}));
  ASSERT_TRUE(few);
  EXPECT_EQ(few->trials, 3);
  EXPECT_DOUBLE_EQ(few->mean_mm, 2.0);
  EXPECT_DOUBLE_EQ(few->standard_error_mm, 1.0 / std::sqrt(3.0)) << "the deviation is 1";
  EXPECT_DOUBLE_EQ(few->median_mm, 2.0);
  EXPECT_DOUBLE_EQ(few->p95_mm, 3.0) << "the largest";
  std::vector<double> errors_mm(20, 0.5);
  errors_mm.back() = 2.0;
  const auto many = errors_over(run_of(errors_mm));
  EXPECT_DOUBLE_EQ(many->p95_mm, 0.5);
  EXPECT_EQ(errors_over(run_of({0.5}))->standard_error_mm, 0.0);
  EXPECT_FALSE(errors_over(run_of({-1.0})));
}

TEST(PairedErrors, CompareTheTrialsThatBothLocated) {
  const PairedErrors paired = paired_errors(run_of({1.0, 9.0, 3.0}), run_of({0.5, -1.0, 0.7}));
  EXPECT_EQ(paired.trials, 2);
  EXPECT_DOUBLE_EQ(paired.first_mm, 2.0);
  EXPECT_DOUBLE_EQ(paired.second_mm, 0.6);
  EXPECT_DOUBLE_EQ(paired.standard_error_mm, 0.9) << "of differences of 0.5 and 2.3";
  EXPECT_EQ(paired_errors(run_of({1.0, -1.0}), run_of({-1.0, 1.0})).trials, 0);
}

TEST(PairedErrors, GainOnlyByMuchAndBeyondChance) {
  const auto gain = [](const std::vector<double>& from, const std::vector<double>& to) {
    return paired_errors(run_of(from), run_of(to)).gain();
  };
  EXPECT_TRUE(gain({1.0, 1.1, 0.9}, {0.8, 0.9, 0.7}));
  EXPECT_FALSE(gain({1.0, 1.1, 0.9}, {0.95, 1.05, 0.85})) << "by 5 % only";
  EXPECT_FALSE(gain({1.0, 1.0, 1.0}, {0.2, 1.1, 1.1})) << "in one trial";
  EXPECT_FALSE(gain({0.8, 0.8}, {1.0, 1.0})) << "a loss";
}

TEST(Knee, IsTheFirstRunThatNoFinerOneGainsOver) {
  const std::vector<TrialErrors> runs = {run_of({4.0, 4.0}), run_of({1.09, 1.09}),
                                         run_of({1.05, 1.05}), run_of({1.0, 1.0})};
  EXPECT_EQ(knee_of(runs), 1U);
  EXPECT_EQ(knee_of(std::span(runs).first(2)), std::nullopt) << "the last run has no finer one";
  const std::vector<TrialErrors> none(3, run_of({-1.0, -1.0}));
  EXPECT_EQ(knee_of(none), std::nullopt) << "no refined poses";
  EXPECT_EQ(knee_of({}), std::nullopt);
  const std::vector<TrialErrors> missing = {run_of({1.0, -1.0}), run_of({1.0, 1.0}),
                                            run_of({1.0, 1.0})};
  EXPECT_EQ(knee_of(missing), 1U) << "bins that miss a trial do not suffice";
}

}  // namespace palpate::bench::trial_errors_test
