// Objects and poses that no touch tells apart.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::tie_test {

HistogramOptions symmetric_options() {
  return {.lattice = {{-4.0, 4.0, 5}, {-4.0, 4.0, 5}, {0, two_pi, 8}, {}}};
}

/// The bin of the pose that is turned by quarters of a turn about the object's middle. The lattice
/// must have the same bins in x and y.
std::int64_t turned_on(const PoseLattice& lattice, std::int64_t bin, int quarters) {
  const std::int64_t n = lattice.x_mm.count;
  const std::int64_t x = bin % n;
  const std::int64_t y = bin % lattice.plane() / n;
  const std::int64_t theta = bin / lattice.plane();
  const std::int64_t turned = (theta + lattice.theta_rad.count / 4) % lattice.theta_rad.count;
  // (x, y) becomes (-y, x).
  const std::int64_t once = turned * lattice.plane() + x * n + (n - 1 - y);
  return quarters == 1 ? once : turned_on(lattice, once, quarters - 1);
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

/// Expects of an object that so many quarters of a turn take to itself: three runs agree with
/// float64, and with each other to the bit; a turn of the pose moves no log-likelihood.
void expect_twins(HardCase& hard, const OccupancyGrid& map, int quarters,
                  const Recording& recording) {
  const std::vector<Hypothesis> objects{{map, 1.0}};
  const HistogramOptions options = symmetric_options();
  std::vector<double> first;
  for (int run = 0; run < 3; ++run) {
    const Estimate estimate = hard.expect_posterior(objects, options, all_touches(recording));
    PoseHistogram histogram(hard.device(), objects, options);
    histogram.update(all_touches(recording));
    EXPECT_EQ(histogram.estimate().mode.bin, estimate.mode.bin);
    const std::vector<double> bins = histogram.log_likelihood(0);
    first = run == 0 ? bins : first;
    EXPECT_EQ(bins, first);
    const auto [least, most] = std::minmax_element(bins.begin(), bins.end());
    EXPECT_GT(*most - *least, 1.0) << "the touches say nothing";
    for (std::size_t bin = 0; bin < bins.size(); ++bin) {
      const std::int64_t twin =
          turned_on(options.lattice, static_cast<std::int64_t>(bin), quarters);
      hard.expect("twins, nats", std::abs(bins[static_cast<std::size_t>(twin)] - bins[bin]), 1e-4);
    }
    const std::vector<double> theta = histogram.marginals(0).theta;
    for (std::size_t t = 0; t < 8; ++t) {
      EXPECT_NEAR(theta[t], theta[(t + 2 * static_cast<std::size_t>(quarters)) % 8], 1e-4);
    }
  }
}

TEST(Tie, IdenticalObjects) {
  HardCase hard("identical objects");
  HardCase bounds("bounds: identical objects, and maps of equal cells");
  HardCase particles("particles: identical objects, and a single particle");
  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 431);
  const Recording recording = random_recording(6, 36, 432);
  const HistogramOptions options = symmetric_options();
  const std::vector<Hypothesis> equal{{map, 1.0}, {map, 1.0}, {map, 1.0}};
  const std::vector<Hypothesis> unequal{{map, 1.0}, {map, 2.0}, {map, 2.0}};
  Estimate estimate = hard.expect_posterior(equal, options, all_touches(recording), {2e-4});
  EXPECT_EQ(estimate.mode.object, 0);
  EXPECT_EQ(estimate.identity, std::vector(3, estimate.identity[0]));
  estimate = hard.expect_posterior(unequal, options, all_touches(recording), {2e-4});
  EXPECT_EQ(estimate.mode.object, 1);
  EXPECT_NEAR(estimate.identity[0], 0.2, 1e-12);
  EXPECT_EQ(estimate.identity[1], estimate.identity[2]);

  estimate = bounds.expect_laws(unequal, options, recording).estimate;
  EXPECT_EQ(estimate.mode.object, 1);
  EXPECT_NEAR(estimate.identity[0], 0.2, 1e-6);
  OccupancyGrid flat = map;
  flat.log_odds.assign(flat.log_odds.size(), 2.0F);
  bounds.expect_laws(std::vector<Hypothesis>{{flat, 1.0}, {flat, 1.0}}, options, recording);

  ParticleOptions of_particles = two_thousand_particles();
  particles.expect_particles(equal, of_particles, recording);
  of_particles.particles = 1;
  const ParticleFilter one = particles.expect_particles(equal, of_particles, recording);
  EXPECT_EQ(std::ranges::max(one.estimate().identity), 1.0);
  EXPECT_EQ(one.effective_sample_size(), 1.0);
}

TEST(Tie, TwoFoldSymmetry) {
  HardCase hard("two-fold symmetry");
  OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 433);
  map.symmetry = 2;
  for (std::size_t cell = 0; cell < map.log_odds.size(); ++cell) {
    map.log_odds[map.log_odds.size() - 1 - cell] = map.log_odds[cell];
  }
  map.origin_mm = -map.cell_mm * glm::dvec2(15.0, 13.0);
  expect_twins(hard, map, 2, random_recording(3, 36, 434));
}

TEST(Tie, FullSymmetry) {
  HardCase hard("full symmetry, touched all over");
  expect_twins(hard, rings(), 1, random_recording(4, 36, 436));
}

TEST(Tie, FullSymmetryTouchedAtTheMiddle) {
  HardCase hard("full symmetry, touched at its middle");
  const std::vector<Hypothesis> objects{{rings(), 1.0}};
  Recording recording;
  recording.T_robot_sensor = {{{12.0, -7.0}, 0.4}, {{12.0, -7.0}, 2.0}};
  recording.elements_mm = {{0.0, 0.0}};
  recording.pressure = {10.0, 5.0};
  HistogramOptions options = symmetric_options();
  options.lattice.pivot_mm = {12.0, -7.0};
  for (int run = 0; run < 3; ++run) {
    const Estimate estimate = hard.expect_posterior(objects, options, all_touches(recording));
    EXPECT_LT(estimate.mode.bin, options.lattice.plane()) << "not of the first theta";
    PoseHistogram histogram(hard.device(), objects, options);
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
