#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::weight_test {

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

TEST(Weight, OfAMillionthByBounds) {
  HardCase hard("bounds: prior weights of 1e-6 and 1e-300 beside 1");
  const Recording recording = random_recording(6, 36, 837);
  for (const double weight : {1e-6, 1e-300}) {
    for (const std::size_t light : {0U, 1U}) {
      std::vector<Hypothesis> objects = two_objects(4.0, 838);
      objects[light].weight = weight;
      BoundedOptions options{.lattice = small_options().lattice};
      hard.expect_laws(objects, options, recording);
      options.evidence_nats = 0.1;
      EXPECT_LE(hard.expect_laws(objects, options, recording).widest_nats, 0.1);
    }
  }
}

TEST(Weight, ExtremelyUnequalOfParticles) {
  HardCase hard("particles: prior weights of 1e-30 beside 1, and of 1e308");
  const auto first_identity = [&](double first, double second) {
    const std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 4.0, 502), first},
                                          {random_map(31, 31, 1.0, 4.0, 503), second}};
    hard.expect_particles(objects, two_thousand_particles(), random_recording(2, 36, 510));
    return ParticleFilter(hard.device(), objects, two_thousand_particles()).estimate().identity[0];
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
    PoseHistogram histogram(hard.device(),
                            std::vector<Hypothesis>{{map, row.first}, {map, row.second}},
                            small_options());
    histogram.update(all_touches(recording));
    const Estimate estimate = histogram.estimate();
    hard.expect("identity", std::abs(estimate.identity[1] - row.identity), 1e-12);
    EXPECT_TRUE(std::isfinite(estimate.mode.log_likelihood));
    EXPECT_EQ(estimate.mode.object, row.mode);
  }
}

}  // namespace palpate::weight_test
