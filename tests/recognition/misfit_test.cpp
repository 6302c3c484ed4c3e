#include "recognition/misfit.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::misfit_test {

double nats(double z, std::size_t touches) { return misfit_nats({.z = z}, touches, {}); }

TEST(Misfit, SpeaksForNoneTheMoreTouchesThereAre) {
  EXPECT_EQ(nats(-4.0, 1), 0.0) << "a stranger's single touch fits as well";
  EXPECT_LT(nats(0.0, 3), -1.5);
  EXPECT_LT(nats(0.0, 9), nats(0.0, 3));
  EXPECT_GT(nats(-4.0, 3), 0.0);
  EXPECT_GT(nats(-8.0, 5), 2.0);
  EXPECT_TRUE(std::isfinite(nats(-largest_fit_z, 2)) && std::isfinite(nats(largest_fit_z, 2)));
}

TEST(Misfit, OfAGoodFitSpeaksAgainstNoneTheMoreTheWorseStrangersFit) {
  const Fit good{.z = 0.0};
  EXPECT_LT(misfit_nats(good, 3, {.stranger_sd = 8.0}), misfit_nats(good, 3, {.stranger_sd = 2.0}));
  EXPECT_EQ(misfit_nats(good, 3, {.stranger_sd = 0.0}), 0.0)
      << "strangers fit as learned objects do";
  const Fit bad{.z = -16.0};
  EXPECT_GT(misfit_nats(bad, 3, {.stranger_sd = 8.0}), misfit_nats(bad, 3, {.stranger_sd = 2.0}));
}

TEST(StrangerDensity, SumsToTheSameWhateverTheSpread) {
  const auto sum = [](std::size_t touches, double stranger_sd) {
    double all = 0.0;
    for (double z = -29.5; z < 30.0; z += 1.0) {
      all += stranger_density({.z = z}, touches, {.stranger_sd = stranger_sd});
    }
    return all;
  };
  EXPECT_NEAR(sum(3, 2.0), sum(1, 2.0), 1e-3 * sum(1, 2.0));
  EXPECT_NEAR(sum(2, 4.0), sum(3, 2.0), 1e-3 * sum(1, 2.0));
}

TEST(Misfit, OfOneTouchIsByWhatStrangersAreLike) {
  const Fit bad{.z = -6.0};
  EXPECT_EQ(misfit_nats(bad, 1, {}), 0.0) << "one touch of a stranger fits as well";
  const FitScale scale{.stranger_sd = 3.0, .stranger_alone = SingleFitScale{-6.0, 2.0}};
  EXPECT_GT(misfit_nats(bad, 1, scale), 2.0);
  EXPECT_LT(misfit_nats({.z = 0.0}, 1, scale), -2.0);
  EXPECT_EQ(misfit_nats(bad, 2, scale), misfit_nats(bad, 2, {.stranger_sd = 3.0}));
  // One in ten of either spreads wider, and all touches of another sensor do.
  const double learned =
      0.9 * std::exp(-2.0) / 3.0 + 0.1 * std::exp(-18.0 / (25.0 + 8.0)) / std::sqrt(25.0 + 8.0);
  const double stranger = 0.9 / 2.0 + 0.1 / std::sqrt(25.0 + 3.0);
  EXPECT_NEAR(misfit_nats(bad, 1, scale), std::log(stranger / learned), 1e-12);
}

}  // namespace palpate::misfit_test
