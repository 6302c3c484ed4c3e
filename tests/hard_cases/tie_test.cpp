#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::tie_test {

HistogramOptions symmetric_options() {
  HistogramOptions options;
  options.lattice = {.x_mm = {-4.0, 4.0, 5}, .y_mm = {-4.0, 4.0, 6}, .theta_rad = {0, two_pi, 8}};
  return options;
}

/// The bin of the pose that is turned by half a turn about the object's middle.
std::int64_t half_a_turn_on(const PoseLattice& lattice, std::int64_t bin) {
  const std::int64_t in_plane = bin % lattice.plane();
  const std::int64_t theta = bin / lattice.plane();
  const std::int64_t turned = (theta + lattice.theta_rad.count / 2) % lattice.theta_rad.count;
  return turned * lattice.plane() + lattice.plane() - 1 - in_plane;
}

/// The bin of the pose that is turned by a quarter of a turn about the object's middle. The lattice
/// must have the same bins in x and y.
std::int64_t a_quarter_turn_on(const PoseLattice& lattice, std::int64_t bin) {
  const std::int64_t n = lattice.x_mm.count;
  const std::int64_t x = bin % n;
  const std::int64_t y = bin % lattice.plane() / n;
  const std::int64_t theta = bin / lattice.plane();
  const std::int64_t turned = (theta + lattice.theta_rad.count / 4) % lattice.theta_rad.count;
  return turned * lattice.plane() + x * n + (n - 1 - y);  // (x, y) becomes (-y, x)
}

/// Rings around the origin: equal to the bit after a quarter turn, nearly equal after other turns.
OccupancyGrid rings() {
  OccupancyGrid map = random_map(41, 41, 0.5, 1.0, 435);
  map.symmetry = 0;
  map.origin_mm = -map.cell_mm * glm::dvec2(20.0);
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      const glm::dvec2 p = map.centre_mm(i, j);
      map.log_odds[static_cast<std::size_t>(j * map.nx + i)] =
          static_cast<float>(4.0 * std::cos(std::hypot(p.x, p.y)));
    }
  }
  return map;
}

/// Expects three runs to agree with float64, and with each other to the bit; `look` sees each run.
void expect_the_same_each_time(HardCase& hard, const std::vector<Hypothesis>& objects,
                               const HistogramOptions& options, const Recording& recording,
                               const std::function<void(const PoseHistogram&)>& look) {
  Device device = Device::open();
  std::vector<double> first;
  for (int run = 0; run < 3; ++run) {
    const Estimate estimate =
        hard.expect_posterior(device, objects, options, all_touches(recording));
    PoseHistogram histogram(device, objects, options);
    histogram.update(all_touches(recording));
    EXPECT_EQ(histogram.estimate().mode.bin, estimate.mode.bin);
    const std::vector<double> bins = histogram.log_likelihood(0);
    if (run == 0) {
      first = bins;
    }
    EXPECT_EQ(bins, first);
    look(histogram);
  }
}

TEST(Tie, IdenticalObjects) {
  HardCase hard("identical objects",
                "rounding of one of them, or the order of a reduction, decides",
                "equal bits; the mode is the first object's, the identity the prior weights'");
  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 431);
  const std::vector<Hypothesis> equal{{map, 1.0}, {map, 1.0}, {map, 1.0}};
  const std::vector<Hypothesis> unequal{{map, 1.0}, {map, 2.0}, {map, 2.0}};
  const Recording recording = random_recording(6, 36, 432);
  Device device = Device::open();
  for (int run = 0; run < 3; ++run) {
    const Estimate estimate =
        hard.expect_posterior(device, equal, symmetric_options(), all_touches(recording), {2e-4});
    EXPECT_EQ(estimate.mode.object, 0);
    EXPECT_EQ(estimate.identity[0], estimate.identity[1]);
    EXPECT_EQ(estimate.identity[0], estimate.identity[2]);
  }
  const Estimate estimate =
      hard.expect_posterior(device, unequal, symmetric_options(), all_touches(recording), {2e-4});
  EXPECT_EQ(estimate.mode.object, 1);
  EXPECT_NEAR(estimate.identity[0], 0.2, 1e-12);
  EXPECT_EQ(estimate.identity[1], estimate.identity[2]);
}

TEST(Tie, TwoFoldSymmetry) {
  HardCase hard("two-fold symmetry",
                "two modes whose bins differ by rounding only: the choice must not wander",
                "the same bits in every run; each half holds half of the mass");
  OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 433);
  map.symmetry = 2;
  for (std::size_t cell = 0; cell < map.log_odds.size(); ++cell) {
    map.log_odds[map.log_odds.size() - 1 - cell] = map.log_odds[cell];
  }
  map.origin_mm = -map.cell_mm * glm::dvec2(15.0, 13.0);
  const std::vector<Hypothesis> objects{{map, 1.0}};
  const Recording recording = random_recording(3, 36, 434);
  const HistogramOptions options = symmetric_options();
  expect_the_same_each_time(hard, objects, options, recording, [&](const PoseHistogram& histogram) {
    const std::vector<double> bins = histogram.log_likelihood(0);
    const Mode mode = histogram.estimate().mode;
    const auto twin = static_cast<std::size_t>(half_a_turn_on(options.lattice, mode.bin.value()));
    EXPECT_NEAR(bins[twin], mode.log_likelihood, 1e-4);
    const std::vector<double> theta = histogram.marginals(0).theta;
    for (std::size_t t = 0; t < 4; ++t) {
      EXPECT_NEAR(theta[t], theta[t + 4], 1e-4) << "half a turn apart";
    }
  });
}

TEST(Tie, FullSymmetry) {
  HardCase hard("full symmetry, touched all over",
                "every pose has a twin at each turn; rounding alone would choose among them",
                "the same bits in every run; a turn of the pose moves no log-likelihood");
  const std::vector<Hypothesis> objects{{rings(), 1.0}};
  const Recording recording = random_recording(4, 36, 436);
  HistogramOptions options = symmetric_options();
  options.lattice.y_mm = options.lattice.x_mm;  // so that quarter turns take bins to bins
  expect_the_same_each_time(hard, objects, options, recording, [&](const PoseHistogram& histogram) {
    const std::vector<double> bins = histogram.log_likelihood(0);
    EXPECT_GT(
        *std::max_element(bins.begin(), bins.end()) - *std::min_element(bins.begin(), bins.end()),
        1.0)
        << "the touches say nothing";
    for (std::size_t bin = 0; bin < bins.size(); ++bin) {
      const auto twin = static_cast<std::size_t>(
          a_quarter_turn_on(options.lattice, static_cast<std::int64_t>(bin)));
      hard.expect("twins, nats", std::abs(bins[twin] - bins[bin]), 1e-4);
    }
    const std::vector<double> theta = histogram.marginals(0).theta;
    for (std::size_t t = 0; t < theta.size(); ++t) {
      EXPECT_NEAR(theta[t], theta[(t + 2) % theta.size()], 1e-4) << "a quarter turn apart";
    }
  });
}

TEST(Tie, FullSymmetryTouchedAtTheMiddle) {
  HardCase hard("full symmetry, touched at its middle", "every theta is as good as the others",
                "equal bits for all thetas; the mode is the lowest bin's");
  const std::vector<Hypothesis> objects{{rings(), 1.0}};
  Recording recording;
  recording.T_robot_sensor = {{{12.0, -7.0}, 0.4}, {{12.0, -7.0}, 2.0}};
  recording.elements_mm = {{0.0, 0.0}};
  recording.pressure = {10.0, 5.0};
  HistogramOptions options = symmetric_options();
  options.lattice.pivot_mm = {12.0, -7.0};
  Device device = Device::open();
  for (int run = 0; run < 3; ++run) {
    const Estimate estimate =
        hard.expect_posterior(device, objects, options, all_touches(recording));
    EXPECT_LT(estimate.mode.bin, options.lattice.plane()) << "not of the first theta";
    PoseHistogram histogram(device, objects, options);
    histogram.update(all_touches(recording));
    const std::vector<double> bins = histogram.log_likelihood(0);
    for (std::size_t bin = 0; bin < bins.size(); ++bin) {
      ASSERT_EQ(bins[bin], bins[bin % static_cast<std::size_t>(options.lattice.plane())]);
    }
    const std::vector<double> theta = histogram.marginals(0).theta;
    EXPECT_EQ(theta, std::vector<double>(8, theta[0]));
  }
}

}  // namespace palpate::tie_test
