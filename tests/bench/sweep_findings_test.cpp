#include "sweep_findings.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::bench {
namespace {

/// A run with these errors of its modes, trial by trial; below 0 where it located nothing.
std::vector<TrialErrors> run_of(const std::vector<double>& errors_mm) {
  std::vector<TrialErrors> run;
  for (const double error_mm : errors_mm) {
    run.push_back({.mode_mm = error_mm < 0.0 ? std::nullopt : std::optional(error_mm)});
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

TEST(ErrorsOverTrials, HaveAStandardErrorAndAPercentileOfManyOnly) {
  const auto few = errors_over(run_of({1.0, 2.0, 3.0, -1.0}), PoseKind::mode);
  ASSERT_TRUE(few);
  EXPECT_EQ(few->trials, 3);
  EXPECT_DOUBLE_EQ(few->mean_mm, 2.0);
  EXPECT_DOUBLE_EQ(few->standard_error_mm, 1.0 / std::sqrt(3.0)) << "the deviation is 1";
  EXPECT_DOUBLE_EQ(few->median_mm, 2.0);
  EXPECT_FALSE(few->p95_mm) << "it would be the largest";
  const auto many = errors_over(run_of(std::vector<double>(20, 0.5)), PoseKind::mode);
  EXPECT_EQ(many->p95_mm, 0.5);
  EXPECT_EQ(errors_over(run_of({0.5}), PoseKind::mode)->standard_error_mm, 0.0);
  EXPECT_FALSE(errors_over(run_of({0.5}), PoseKind::refined));
  EXPECT_FALSE(errors_over(run_of({-1.0}), PoseKind::mode));
}

TEST(PairedErrors, CompareTheTrialsThatBothLocated) {
  const PairedErrors paired =
      paired_errors(run_of({1.0, 9.0, 3.0}), run_of({0.5, -1.0, 0.7}), PoseKind::mode);
  EXPECT_EQ(paired.trials, 2);
  EXPECT_DOUBLE_EQ(paired.first_mm, 2.0);
  EXPECT_DOUBLE_EQ(paired.second_mm, 0.6);
  EXPECT_DOUBLE_EQ(paired.standard_error_mm, 0.9) << "of differences of 0.5 and 2.3";
  EXPECT_EQ(paired_errors(run_of({1.0}), run_of({1.0}), PoseKind::refined).trials, 0);
}

TEST(PairedErrors, GainOnlyByMuchAndBeyondChance) {
  const auto gain = [](const std::vector<double>& from, const std::vector<double>& to) {
    return paired_errors(run_of(from), run_of(to), PoseKind::mode).gain();
  };
  EXPECT_TRUE(gain({1.0, 1.1, 0.9}, {0.8, 0.9, 0.7}));
  EXPECT_FALSE(gain({1.0, 1.1, 0.9}, {0.95, 1.05, 0.85})) << "by 5 % only";
  EXPECT_FALSE(gain({1.0, 1.0, 1.0}, {0.2, 1.1, 1.1})) << "in one trial";
  EXPECT_FALSE(gain({0.8, 0.8}, {1.0, 1.0})) << "a loss";
}

TEST(Knee, IsTheFirstRunThatNoFinerOneGainsOver) {
  const std::vector<std::vector<TrialErrors>> runs = {run_of({4.0, 4.0}), run_of({1.09, 1.09}),
                                                      run_of({1.05, 1.05}), run_of({1.0, 1.0})};
  EXPECT_EQ(knee_of(runs, PoseKind::mode), 1U);
  EXPECT_EQ(knee_of(std::span(runs).first(2), PoseKind::mode), std::nullopt)
      << "the last run has no finer one";
  EXPECT_EQ(knee_of(runs, PoseKind::refined), std::nullopt) << "no refined poses";
  EXPECT_EQ(knee_of({}, PoseKind::mode), std::nullopt);
  const std::vector<std::vector<TrialErrors>> missing = {run_of({1.0, -1.0}), run_of({1.0, 1.0}),
                                                         run_of({1.0, 1.0})};
  EXPECT_EQ(knee_of(missing, PoseKind::mode), 1U) << "bins that miss a trial do not suffice";
}

}  // namespace
}  // namespace palpate::bench
