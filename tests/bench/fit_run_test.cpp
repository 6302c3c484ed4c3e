#include "fit_run.hpp"

#include <gtest/gtest.h>

namespace palpate::bench::fit_run_test {

FitRun small_run() {
  FitRun run;
  for (const double z : {1.0, 0.0, -3.5}) {
    run.learned.add({.z = z, .verdict = z < -3.0 ? Verdict::doubtful : Verdict::fits});
  }
  for (const double z : {0.5, -3.5}) {
    run.unlearned.add({.z = z, .verdict = z < -3.0 ? Verdict::doubtful : Verdict::fits});
  }
  return run;
}

TEST(FitRun, CountsPairsAndVerdicts) {
  const FitRun run = small_run();
  // 0.5 is worse than 1; -3.5 than 1 and 0, and as bad as -3.5.
  EXPECT_DOUBLE_EQ(run.told_apart(), (1.0 + 2.0 + 0.5) / 6.0);
  EXPECT_EQ(run.learned.count(Verdict::fits), 2);
  EXPECT_EQ(run.learned.count(Verdict::doubtful), 1);
  EXPECT_EQ(run.unlearned.count(Verdict::does_not_fit), 0);
}

TEST(FitRun, IsAsSureAsItHasUnknownsOfTheRarerKind) {
  FitRun run = small_run();
  const Interval interval = run.told_apart_interval();
  EXPECT_EQ(interval.low, wilson_interval(2.0 * 3.5 / 6.0, 2).low);
  EXPECT_LT(interval.low, run.told_apart());
  EXPECT_GT(interval.high, run.told_apart());
  run.unlearned.z = {-9.0, -8.0};
  EXPECT_EQ(run.told_apart(), 1.0);
  EXPECT_EQ(run.told_apart_interval().high, 1.0);
  EXPECT_LT(run.told_apart_interval().low, 0.5) << "two unknowns say little";
}

}  // namespace palpate::bench::fit_run_test
