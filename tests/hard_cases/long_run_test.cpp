#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::long_run_test {

/// Errors add up over a run, by 3e-6 to 5e-6 nats per touch: where touches repeat, the logarithm of
/// eight factors always rounds the same way. Near the top, all bins err alike, and what remains is
/// the error of the identities, which are nearly even here.
constexpr Allowed long_run(int touches, double near_top_nats, double identity) {
  return {.nats = touches * 3e-5,
          .near_top_nats = near_top_nats,
          .identity = identity,
          .marginal = identity};
}

constexpr int most_touches = sanitized ? 1'000 : 10'000;

/// Two objects so similar that thousands of touches hardly distinguish them.
std::vector<Hypothesis> near_twins() {
  const OccupancyGrid one = random_map(61, 61, 0.5, 40.0, 401);
  OccupancyGrid other = one;
  Uniform random(402);
  for (float& l : other.log_odds) {
    l += static_cast<float>(random(-1e-3, 1e-3));
  }
  return {{one, 1.0}, {other, 1.0}};
}

/// A few bins so close together that all of them stay near the top.
HistogramOptions near_the_top(int rows, int thetas = 3) {
  return {.lattice = {{-0.002, 0.002, 3}, {1.0, 1.002, rows}, {0.5, 0.5005, thetas}, {}}};
}

TEST(LongRun, TenThousandTouchesInARow) {
  HardCase hard("10,000 touches in a row, log-likelihoods of -1e6");
  const std::vector<Hypothesis> objects = near_twins();
  const Recording recording = random_recording(most_touches, 100, 403);
  // Four rows take register tiles, one row takes runs of bins. float64 takes long for every theta.
  for (const int rows : {4, 1}) {
    const Estimate estimate =
        hard.expect_posterior(objects, near_the_top(rows, 1), all_touches(recording),
                              long_run(most_touches, 0.01, 1e-3));  // 2.5e-3 seen
    EXPECT_LT(estimate.mode.log_likelihood, -100.0 * most_touches) << "the case is not hard enough";
    EXPECT_GT(estimate.identity[0], 1e-6) << "no longer near the top";
    EXPECT_GT(estimate.identity[1], 1e-6) << "no longer near the top";
  }
}

TEST(LongRun, TheSameTouchTenThousandTimes) {
  HardCase hard("the same touch 10,000 times");
  const std::vector<Hypothesis> objects = near_twins();
  const Recording recording = random_recording(1, 36, 404);
  std::vector<Touch> touches(100, recording.touch(0));
  for (const int rows : {4, 1}) {
    hard.expect_posterior(objects, near_the_top(rows), touches,
                          long_run(most_touches, 0.05, 1e-2),  // 1.8e-2 seen
                          most_touches / 100);
  }
}

}  // namespace palpate::long_run_test
