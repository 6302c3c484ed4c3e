// Objects and poses that no touch tells apart, and weights that do.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::tie_test {

HistogramOptions symmetric_options() {
  return {.lattice = {{-4.0, 4.0, 5}, {-4.0, 4.0, 5}, {0, two_pi, 8}, {}}};
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

TEST(Tie, OfAllAnglesWhereOneElementTouchesThePivot) {
  HardCase hard("one element, at the pivot");
  const std::vector<Hypothesis> objects{{random_map(41, 41, 0.5, 4.0, 435), 1.0}};
  Recording recording;
  recording.T_robot_sensor = {{{12.0, -7.0}, 0.4}, {{12.0, -7.0}, 2.0}};
  recording.elements_mm = {{0.0, 0.0}};
  recording.pressure = {10.0, 5.0};
  HistogramOptions options = symmetric_options();
  options.lattice.pivot_mm = {12.0, -7.0};
  const Estimate estimate = hard.expect_posterior(objects, options, all_touches(recording));
  EXPECT_LT(estimate.mode.bin, options.lattice.plane()) << "not of the first theta";
  PoseHistogram histogram(shared_device(), objects, options);
  histogram.update(all_touches(recording));
  const std::vector<double> bins = histogram.log_likelihood(0);
  for (std::size_t bin = 0; bin < bins.size(); ++bin) {
    ASSERT_EQ(bins[bin], bins[bin % static_cast<std::size_t>(options.lattice.plane())]);
  }
  const std::vector<double> theta = histogram.marginals(0).theta;
  EXPECT_EQ(theta, std::vector<double>(8, theta[0]));
}

TEST(Weight, ExtremelyUnequal) {
  HardCase hard("prior weights of 1e-30 beside 1");
  std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 471), 1.0},
                                  {random_map(31, 27, 0.5, 6.0, 472), 1e-30}};
  const Recording recording = random_recording(40, 36, 473);
  const Estimate before = hard.expect_posterior(objects, small_options(), {});
  EXPECT_NEAR(before.identity[1], 1e-30, 1e-36) << "the weight itself, to six digits";

  // The object that the touches favour gets the small weight: the evidence must outweigh 69 nats.
  const auto told = [&](double first, double second) {
    objects[0].weight = first;
    objects[1].weight = second;
    return hard.expect_posterior(objects, small_options(), all_touches(recording),
                                 {.nats = 5e-4, .near_top_nats = 8e-5});
  };
  const auto log_odds_of = [](const Estimate& estimate, int object) {
    const auto i = static_cast<std::size_t>(object);
    return std::log(estimate.identity[i]) - std::log(estimate.identity[1 - i]);
  };
  const Estimate equal = told(1.0, 1.0);
  const int favoured = equal.mode.object;
  const Estimate after = favoured == 0 ? told(1e-30, 1.0) : told(1.0, 1e-30);
  EXPECT_NEAR(log_odds_of(after, favoured), log_odds_of(equal, favoured) - 30.0 * std::log(10.0),
              1e-9);
}

TEST(Weight, ExtremelyUnequalOfParticles) {
  HardCase hard("particles: prior weights of 1e-30 beside 1, and of 1e308");
  const auto first_identity = [&](double first, double second) {
    const std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 4.0, 502), first},
                                          {random_map(31, 31, 1.0, 4.0, 503), second}};
    hard.expect_particles(objects, two_thousand_particles(), random_recording(2, 36, 510));
    return ParticleFilter(shared_device(), objects, two_thousand_particles())
        .estimate()
        .identity[0];
  };
  EXPECT_EQ(first_identity(1e-30, 1.0), 0.0) << "too light for one of 2,000 particles";
  EXPECT_NEAR(first_identity(1e308, 1e308), 0.5, 1e-12);
  EXPECT_NEAR(first_identity(5e-324, 5e-324), 0.5, 1e-12);
}

TEST(Weight, AtTheEndsOfFloat64) {
  HardCase hard("prior weights of 1e308 and of 5e-324");
  const OccupancyGrid map = random_map(31, 27, 0.5, 6.0, 474);
  const Recording recording = random_recording(2, 36, 475);
  struct Row {
    double first;
    double second;
    double identity;  ///< of the second
    int mode;
  };
  for (const Row& row :
       {Row{1e308, 1.5e308, 0.6, 1}, Row{5e-324, 5e-324, 0.5, 0}, Row{5e-324, 1e308, 1.0, 1}}) {
    SCOPED_TRACE(::testing::Message() << row.first << " and " << row.second);
    PoseHistogram histogram(shared_device(),
                            std::vector<Hypothesis>{{map, row.first}, {map, row.second}},
                            small_options());
    histogram.update(all_touches(recording));
    const Estimate estimate = histogram.estimate();
    hard.expect("identity", std::abs(estimate.identity[1] - row.identity), 1e-12);
    EXPECT_TRUE(std::isfinite(estimate.mode.log_likelihood));
    EXPECT_EQ(estimate.mode.object, row.mode);
  }
}

}  // namespace palpate::tie_test
