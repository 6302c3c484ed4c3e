// Runs of very many touches, and lattices of very many bins.

#include <algorithm>
#include <cmath>
#include <numbers>

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

// The belief takes 400 MB on the device, in several bindings if one binding cannot hold it.
constexpr PoseLattice fifty_million() {
  constexpr double step = 2.0 * std::numbers::pi / 250;
  // Bins as wide as the map's cells, and centred on them.
  return {.x_mm = {-5.0, 5.0, 500},
          .y_mm = {-4.0, 4.0, 400},
          .theta_rad = {-step / 2, 2.0 * std::numbers::pi - step / 2, 250}};
}

// In the last tenth of the bins. The pose half a turn away, which swaps the ends, is not in a bin.
constexpr std::int64_t chosen_bin = (std::int64_t{231} * 400 + 317) * 500 + 349;

/// One row of cells that are certainly empty except for both ends, which are certainly occupied.
OccupancyGrid two_certain_cells(const glm::dvec2& first_mm) {
  OccupancyGrid map{.label = "two cells",
                    .cell_mm = 0.02,
                    .origin_mm = first_mm,
                    .prior = 1e-30,
                    .nx = 251,
                    .ny = 1};
  map.log_odds.assign(251, -1000.0F);
  map.log_odds.front() = map.log_odds.back() = 1000.0F;
  return map;
}

/// A touch whose two elements lie on the map's two ends at this pose only.
Recording touch_of_both_ends(const Pose& T_object_robot, const OccupancyGrid& map) {
  Recording recording;
  recording.T_robot_sensor.resize(1);
  for (const int cell : {0, map.nx - 1}) {
    recording.elements_mm.push_back(inverse(T_object_robot) * map.centre_mm(cell, 0));
    recording.pressure.push_back(10.0);
  }
  return recording;
}

TEST(FiftyMillionBins, OfWhichOneOrAllHoldTheMass) {
  HardCase hard("50 M bins, of which one holds all the mass, or all hold the same");
  const PoseLattice lattice = fifty_million();
  const Pose chosen = reference::bin_pose(lattice, chosen_bin);
  const OccupancyGrid map = two_certain_cells(chosen.translation_mm);
  const Hypothesis hypothesis{map, 1.0};
  const HistogramOptions options{.lattice = lattice, .contact = {.gamma = 0.0}};
  const auto bins = static_cast<double>(lattice.bins());
  PoseHistogram histogram(shared_device(), std::span(&hypothesis, 1), options);

  const Recording recording = touch_of_both_ends(chosen, map);
  histogram.update(all_touches(recording));
  Estimate estimate = histogram.estimate();
  EXPECT_EQ(estimate.mode.bin, chosen_bin);
  EXPECT_EQ(estimate.mode.log_likelihood, 0.0) << "a certain element costs nothing";
  EXPECT_EQ(estimate.identity, std::vector{1.0});
  Marginals marginals = histogram.marginals(0);
  // Every other bin has an element in unseen space, at 69 nats, or worse: 50 M exp(-69) = 5e-23.
  const auto in_plane = static_cast<std::size_t>(chosen_bin % lattice.plane());
  const auto theta = static_cast<std::size_t>(chosen_bin / lattice.plane());
  hard.expect("mass of the one bin", std::abs(marginals.xy[in_plane] - 1.0), 1e-15);
  hard.expect("mass of the one bin", std::abs(marginals.theta[theta] - 1.0), 1e-15);
  hard.expect("mass of the others", sum(marginals.xy) - marginals.xy[in_plane], 1e-20);
  hard.expect("mass of the others", sum(marginals.theta) - marginals.theta[theta], 1e-20);
  {
    const std::vector<double> product = histogram.log_likelihood(0);
    EXPECT_TRUE(all_finite(product));
    Uniform random(481);
    for (int sample = 0; sample < 2000; ++sample) {
      // Half of the bins are near the pose.
      const auto bin = sample % 2 == 0
                           ? static_cast<std::int64_t>(random(0.0, bins))
                           : chosen_bin + static_cast<std::int64_t>(random(-1500.0, 1500.0));
      const double expected = reference::log_likelihood(
          recording.touch(0), reference::bin_pose(lattice, bin), map, options.contact);
      hard.expect("log-likelihood, nats",
                  std::abs(product[static_cast<std::size_t>(bin)] - expected),
                  Allowed{.nats = 5e-4, .relative = 3e-7}.at(expected));
    }
  }

  // One reading in unseen space gives every bin the same log-likelihood: log m = -69 nats.
  histogram.reset();
  const Recording off = moved(recording, {{1000.0, 1000.0}, 0.0});
  histogram.update(all_touches(off));
  estimate = histogram.estimate();
  EXPECT_EQ(estimate.mode.bin, 0) << "ties go to the lowest bin";
  hard.expect("log-likelihood, nats",
              std::abs(estimate.mode.log_likelihood - 2.0 * std::log(map.prior)), 5e-5);
  EXPECT_EQ(estimate.identity, std::vector{1.0});
  marginals = histogram.marginals(0);
  const auto [least, most] = std::minmax_element(marginals.xy.begin(), marginals.xy.end());
  // Sums of 250 and of 200,000 equal terms.
  hard.expect("equal marginals, relative", std::abs(*least * bins / 250.0 - 1.0), 1e-6);
  hard.expect("equal marginals, relative", std::abs(*most * bins / 250.0 - 1.0), 1e-6);
  for (const double p : marginals.theta) {
    hard.expect("equal marginals, relative", std::abs(p * 250.0 - 1.0), 1e-6);
  }
}

}  // namespace palpate::long_run_test
