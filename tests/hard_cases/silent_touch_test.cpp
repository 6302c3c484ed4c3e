#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"
#include "support/limits.hpp"

namespace palpate::silent_touch_test {

TEST(SilentTouch, AllUnknown) {
  HardCase hard("all-Unknown touches: dead elements, no numbers, between the thresholds");
  Recording recording = random_recording(5, 36, 424);
  recording.valid.assign(recording.pressure.size(), 1);
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    recording.valid[i] = i < 36 ? 0 : 1;
    // Above 0.3 of the largest pressure and below the threshold.
    recording.pressure[i] = i >= 36 && i < 72 ? nan : 1.0 + 0.01 * static_cast<double>(i % 36);
  }
  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 421), 1.0},
                                        {random_map(25, 25, 0.5, 6.0, 422), 2.0},
                                        {random_map(14, 15, 1.0, 6.0, 423), 1.0}};
  const Estimate estimate =
      hard.expect_posterior(objects, small_options(), all_touches(recording), {.nats = 0.0});
  EXPECT_EQ(estimate.mode.log_likelihood, 0.0);
  EXPECT_EQ(estimate.mode.object, 1) << "the heaviest";
  EXPECT_EQ(estimate.mode.bin, 0) << "ties go to the lowest bin";
  EXPECT_NEAR(estimate.identity[1], 0.5, 1e-15);
}

/// Expects touches that say nothing to leave all particles alike.
ParticleFilter expect_alike(HardCase& hard, const Recording& recording) {
  const std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 4.0, 502), 1.0},
                                        {random_map(31, 31, 1.0, 4.0, 503), 1.0}};
  ParticleFilter filter = hard.expect_particles(objects, two_thousand_particles(), recording);
  const std::vector<ParticleFilter::Particle> particles = filter.particles();
  for (const ParticleFilter::Particle& particle : particles) {
    EXPECT_EQ(particle.weight, particles.front().weight);
  }
  return filter;
}

TEST(SilentTouch, EntirelyOffTheMap) {
  HardCase hard("touches entirely off the map, by 40 to 1e300 mm");
  HardCase particles("particles: all-Unknown touches, and touches off the map by 40 to 1e300 mm");
  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 426), 1.0},
                                        {random_map(25, 25, 0.5, 6.0, 427), 1.0}};
  for (const double away_mm : {40.0, 1e6, 1e12, 1e300}) {
    const Recording recording = moved(random_recording(3, 36, 428), {{away_mm, -away_mm}, 0.0});
    double expected = 0.0;
    for (const Touch& touch : all_touches(recording)) {
      for (const ElementReading& r : known_readings(touch, {})) {
        expected +=
            ContactModel{.prior = 0.2}.log_likelihood(r.reading, {.log_odds = std::log(0.2 / 0.8)});
      }
    }
    for (const double gamma : {0.1, 0.0}) {
      HistogramOptions options = small_options();
      options.contact.gamma = gamma;
      const Estimate estimate = hard.expect_posterior(objects, options, all_touches(recording));
      EXPECT_EQ(estimate.mode.bin, 0) << "all bins are alike";
      EXPECT_EQ(estimate.mode.object, 0);
      EXPECT_EQ(estimate.identity, (std::vector{0.5, 0.5}));
      if (gamma > 0.0) {
        EXPECT_NEAR(estimate.mode.log_likelihood, expected, 1e-4);
      }
    }
    expect_alike(particles, recording);
  }
  Recording unknown = random_recording(5, 36, 504);
  unknown.pressure.assign(unknown.pressure.size(), ContactClassifier{}.threshold);
  EXPECT_NEAR(expect_alike(particles, unknown).estimate().identity[0], 0.5, 1e-12);
}

}  // namespace palpate::silent_touch_test
