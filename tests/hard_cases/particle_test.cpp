#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"
#include "palpate/particle_filter.hpp"

namespace palpate::particle_test {

ParticleOptions two_thousand() {
  ParticleOptions options;
  options.particles = 2000;
  options.region = {.x_mm = {-5.0, 5.0, 1}, .y_mm = {-5.0, 5.0, 1}, .theta_rad = {0, two_pi, 1}};
  options.seed = 501;
  return options;
}

std::vector<Hypothesis> two_objects() {
  return {{random_map(61, 61, 0.5, 4.0, 502), 1.0}, {random_map(31, 31, 1.0, 4.0, 503), 1.0}};
}

/// Expects a filter's results to be finite, and its probabilities to sum to 1.
Estimate expect_sound(const ParticleFilter& filter, int particles) {
  std::vector<double> weights;
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    weights.push_back(particle.weight);
    EXPECT_TRUE(is_finite(particle.T_object_robot));
  }
  EXPECT_NEAR(total(weights), 1.0, 1e-12);
  const double effective = filter.effective_sample_size();
  EXPECT_GE(effective, 1.0);
  EXPECT_LE(effective, particles);
  Estimate estimate = filter.estimate();
  EXPECT_NEAR(total(estimate.identity), 1.0, 1e-12);
  EXPECT_TRUE(std::isfinite(estimate.mode.log_likelihood));
  EXPECT_TRUE(is_finite(estimate.mode.T_object_robot));
  return estimate;
}

/// Gives one touch to the filter and expects every particle's weight to agree with float64 at the
/// particle's pose.
Estimate expect_weights(HardCase& hard, ParticleFilter& filter, const Touch& touch,
                        std::span<const Hypothesis> objects, const ParticleOptions& options,
                        double allowed_nats = 1e-4) {
  filter.update(touch);
  const std::vector<ParticleFilter::Particle> particles = filter.particles();
  std::vector<double> expected;
  for (const ParticleFilter::Particle& particle : particles) {
    const OccupancyGrid& map = objects[static_cast<std::size_t>(particle.object)].map;
    expected.push_back(
        reference::log_likelihood(touch, particle.T_object_robot, map, options.contact));
  }
  const double most = *std::max_element(expected.begin(), expected.end());
  const std::vector<double> weights = reference::importance_weights(expected);
  // The largest error of the weights that are not negligible.
  double error = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (expected[i] > most - 20.0) {
      error = std::max(error, std::abs(std::log(particles[i].weight / weights[i])));
    }
  }
  hard.expect("log weights near the top, nats", error, 2.0 * allowed_nats);
  return expect_sound(filter, options.particles);
}

bool all_weigh_the_same(const ParticleFilter& filter) {
  const auto particles = filter.particles();
  return std::ranges::all_of(
      particles, [&](const auto& one) { return one.weight == particles.front().weight; });
}

TEST(Particles, OfTouchesThatSayNothing) {
  HardCase hard("particles: all-Unknown touches, and touches off the map by 40 to 1e300 mm");
  const std::vector<Hypothesis> objects = two_objects();
  const ParticleOptions options = two_thousand();
  ParticleFilter filter(hard.device(), objects, options);
  Recording unknown = random_recording(5, 36, 504);
  unknown.pressure.assign(unknown.pressure.size(), options.contact.classifier.threshold);
  filter.update(all_touches(unknown));
  const Estimate estimate = expect_sound(filter, options.particles);
  EXPECT_TRUE(all_weigh_the_same(filter));
  EXPECT_NEAR(estimate.identity[0], 0.5, 1e-12);
  for (const double away_mm : {40.0, 1e6, 1e300}) {
    const Recording off = moved(random_recording(2, 36, 505), {{away_mm, 0.0}, 0.0});
    for (const Touch& touch : all_touches(off)) {
      expect_weights(hard, filter, touch, objects, options);
      EXPECT_TRUE(all_weigh_the_same(filter)) << away_mm;
    }
  }
}

TEST(Particles, OfIdenticalObjectsAndOfOneParticle) {
  HardCase hard("particles: identical objects, and a single particle");
  const OccupancyGrid map = random_map(31, 27, 0.5, 4.0, 506);
  const std::vector<Hypothesis> objects{{map, 1.0}, {map, 1.0}};
  const Recording recording = random_recording(3, 36, 507);
  for (const int particles : {2000, 1}) {
    ParticleOptions options = two_thousand();
    options.particles = particles;
    ParticleFilter filter(hard.device(), objects, options);
    for (const Touch& touch : all_touches(recording)) {
      const Estimate estimate = expect_weights(hard, filter, touch, objects, options);
      if (particles == 1) {
        EXPECT_EQ(*std::max_element(estimate.identity.begin(), estimate.identity.end()), 1.0);
        EXPECT_EQ(filter.effective_sample_size(), 1.0);
      }
    }
  }
}

TEST(Particles, FarFromTheRobotsOrigin) {
  HardCase hard("particles: 1e6 mm from the robot's origin, with a pivot, after 1e6 turns");
  const std::vector<Hypothesis> objects = two_objects();
  ParticleOptions options = two_thousand();
  options.region.pivot_mm = {1e6, -1e6};
  options.region.theta_rad = {1e6 * two_pi, 1e6 * two_pi + two_pi, 1};
  const Recording recording = moved(random_recording(3, 36, 508), {{1e6, -1e6}, 0.0});
  ParticleFilter filter(hard.device(), objects, options);
  for (const Touch& touch : all_touches(recording)) {
    const Estimate estimate = expect_weights(hard, filter, touch, objects, options);
    EXPECT_NE(estimate.identity[0], 0.5) << "off the map";
  }
}

TEST(Particles, OfCertainMapsWithoutGamma) {
  HardCase hard("particles: gamma = 0 on maps at log odds of +-1,000, all contradicted");
  std::vector<Hypothesis> objects = two_objects();
  for (Hypothesis& object : objects) {
    for (float& l : object.map.log_odds) {
      l = l > 0.0F ? 1000.0F : -1000.0F;
    }
  }
  const Recording recording = random_recording(3, 36, 509);
  for (const bool augmented : {false, true}) {
    ParticleOptions options = two_thousand();
    options.contact.gamma = 0.0;
    options.augmented = augmented;
    ParticleFilter filter(hard.device(), objects, options);
    for (const Touch& touch : all_touches(recording)) {
      expect_weights(hard, filter, touch, objects, options, 5e-3);
      EXPECT_TRUE(filter.estimate().contradicted);
    }
  }
}

TEST(Particles, OfExtremelyUnequalWeights) {
  HardCase hard("particles: prior weights of 1e-30 beside 1, and of 1e308");
  std::vector<Hypothesis> objects = two_objects();
  const Recording recording = random_recording(2, 36, 510);
  const ParticleOptions options = two_thousand();
  const auto first_identity = [&](double first, double second) {
    objects[0].weight = first;
    objects[1].weight = second;
    ParticleFilter filter(hard.device(), objects, options);
    const double identity = filter.estimate().identity[0];
    for (const Touch& touch : all_touches(recording)) {
      expect_weights(hard, filter, touch, objects, options);
    }
    return identity;
  };
  EXPECT_EQ(first_identity(1e-30, 1.0), 0.0) << "too light for one of 2,000 particles";
  EXPECT_NEAR(first_identity(1e308, 1e308), 0.5, 1e-12);
  EXPECT_NEAR(first_identity(5e-324, 5e-324), 0.5, 1e-12);
}

}  // namespace palpate::particle_test
