#include "estimation/bounded/evaluated_bins.hpp"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "synthetic.hpp"

namespace palpate::followed_bins_test {

TEST(FollowedBins, BoundWhatLiesOutsideThroughFurtherTouches) {
  const std::vector<Hypothesis> two{{random_map(9, 9, 0.5, 3.0, 841), 1.0},
                                    {random_map(9, 9, 0.5, 3.0, 842), 3.0}};
  const PoseLattice lattice{.x_mm = {-1.0, 1.0, 3}, .y_mm = {-1.0, 1.0, 2}};
  const BinLikelihood likelihood(two, {.prior = 0.2}, lattice);
  const std::array<double, 2> log_weight{std::log(0.25), std::log(0.75)};
  EvaluatedBins bins;
  bins.add({.object = 0, .theta = 1, .y_count = 1, .x_count = 2}, std::array{-1.0, -2.0});
  // One number stands for six bins that saw the prior alone.
  bins.add({.object = 1, .theta = 2, .y_count = 2, .x_count = 3}, std::array{-6.0});
  SearchResult found;
  found.mass = {{.dropped = -9.0}, {.dropped = -7.0}};
  FollowedBins followed(bins, found, log_weight, 1);
  const double inside = 0.25 * (std::exp(-1.0) + std::exp(-2.0));
  const double seen_by_prior = 0.75 * 6.0 * std::exp(-6.0);
  EXPECT_NEAR(followed.log_total(), std::log(inside), 1e-12);
  EXPECT_NEAR(followed.share_outside(), (std::exp(-9.0) + std::exp(-7.0) + seen_by_prior) / inside,
              1e-12);
  // A touch without a known element leaves the bins as they are; elsewhere poses may explain it.
  followed.add({}, likelihood, std::array{2.0, -1.0});
  EXPECT_EQ(followed.touches(), 2U);
  EXPECT_NEAR(followed.log_total(), std::log(inside), 1e-12);
  EXPECT_NEAR(followed.share_outside(),
              (std::exp(-9.0 + 2.0) + std::exp(-1.0) * (std::exp(-7.0) + seen_by_prior)) / inside,
              1e-12);
}

}  // namespace palpate::followed_bins_test
