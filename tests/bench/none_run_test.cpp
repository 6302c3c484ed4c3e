#include "none_run.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::bench::none_run_test {

RecognitionStep step_of(std::vector<double> identity, std::size_t best) {
  RecognitionStep step;
  step.identity = std::move(identity);
  step.best = best;
  return step;
}

TEST(NoneCalls, CountsWhereNoneIsTheMostProbable) {
  NoneCalls calls;
  calls.add(step_of({0.5, 0.1, 0.4}, 0));
  calls.add(step_of({0.3, 0.3, 0.4}, 2));
  EXPECT_EQ(calls.called_none, 1);
  EXPECT_DOUBLE_EQ(calls.share_called_none(), 0.5);
  ASSERT_EQ(calls.log_odds.size(), 2U);
  // None against all letters together, not against the best.
  EXPECT_DOUBLE_EQ(calls.log_odds[0], std::log(0.4 / 0.6));
  EXPECT_EQ(calls.log_odds[0], calls.log_odds[1]);
}

TEST(NoneCalls, StayFiniteWhereProbabilitiesVanish) {
  NoneCalls calls;
  calls.add(step_of({0.0, 0.0, 1.0}, 2));
  calls.add(step_of({1.0, 0.0, 0.0}, 0));
  EXPECT_GT(calls.log_odds[0], 700.0);
  EXPECT_LT(calls.log_odds[1], -700.0);
}

TEST(NoneRun, TellsApartByTheOdds) {
  NoneRun run;
  run.learned.log_odds = {-3.0, -1.0};
  run.unlearned.log_odds = {-2.0, 4.0, 5.0};
  EXPECT_DOUBLE_EQ(run.told_apart(), 5.0 / 6.0);
  EXPECT_LT(run.told_apart_interval().low, 5.0 / 6.0);
}

}  // namespace palpate::bench::none_run_test
