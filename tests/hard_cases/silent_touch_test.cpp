#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "hard_case.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::silent_touch_test {

constexpr double subnormal = std::numeric_limits<double>::denorm_min();

std::vector<Hypothesis> three_objects() {
  return {{random_map(31, 27, 0.5, 6.0, 421), 1.0},
          {random_map(25, 25, 0.5, 6.0, 422), 2.0},
          {random_map(14, 15, 1.0, 6.0, 423), 1.0}};
}

/// Expects that touches without known elements change no bit of a bin, and make no map.
void expect_nothing_said(HardCase& hard, const Recording& recording) {
  const std::vector<Hypothesis> objects = three_objects();
  const Estimate estimate =
      hard.expect_posterior(objects, small_options(), all_touches(recording), {.nats = 0.0});
  EXPECT_EQ(estimate.mode.log_likelihood, 0.0);
  EXPECT_EQ(estimate.mode.object, 1) << "the heaviest";
  EXPECT_EQ(estimate.mode.bin, 0) << "ties go to the lowest bin";
  EXPECT_NEAR(estimate.identity[1], 0.5, 1e-15);
  MapBuilder builder(hard.device(), {});
  builder.add(all_touches(recording));
  expect_named(input_error([&] { builder.build("silent"); }), {"silent", "In Contact"});
}

TEST(SilentTouch, AllUnknown) {
  HardCase hard("all-Unknown touches: dead elements, no numbers, between the thresholds");
  Recording recording = random_recording(5, 36, 424);
  recording.valid.assign(recording.pressure.size(), 1);
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    recording.valid[i] = i < 36 ? 0 : 1;
    // Above 0.3 of the largest pressure and below the threshold.
    recording.pressure[i] = i >= 36 && i < 72 ? nan : 1.0 + 0.01 * static_cast<double>(i % 36);
  }
  expect_nothing_said(hard, recording);
}

TEST(SilentTouch, EveryElementAtTheThreshold) {
  HardCase hard("every element exactly at the threshold, or at the ratio of the largest");
  Recording recording = random_recording(2, 36, 425);
  recording.pressure.assign(recording.pressure.size(), 2.0);
  // The second touch's largest pressure equals the threshold; the others equal 0.3 of the largest.
  for (std::size_t i = 37; i < 72; ++i) {
    recording.pressure[i] = 0.3 * 2.0;
  }
  expect_nothing_said(hard, recording);

  // Equal to 0.3 of the largest pressure and above the threshold.
  recording.pressure[36] = 20.0;
  for (std::size_t i = 37; i < 72; ++i) {
    recording.pressure[i] = 0.3 * 20.0;
  }
  const Touch touch = recording.touch(1);
  EXPECT_EQ(ContactClassifier{}.classify(touch), reference::classify(touch, ContactClassifier{}));
  EXPECT_EQ(known_readings(touch, {}).size(), 1U) << "only the 20 kPa say anything";
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

TEST(SilentTouch, SubnormalPressures) {
  HardCase hard("subnormal pressures and thresholds");
  // Small whole numbers, and these numbers times `subnormal`.
  Recording recording = random_recording(4, 36, 429);
  Uniform random(430);
  for (double& p : recording.pressure) {
    p = std::floor(random(0.0, 12.0));
  }
  Recording tiny = recording;
  for (double& p : tiny.pressure) {
    p *= subnormal;
  }
  HistogramOptions options = small_options();
  const std::vector<Hypothesis> objects = three_objects();
  // ratio * (largest pressure) is a whole multiple of `subnormal`, or lies between two multiples.
  for (const double ratio : {0.5, 0.25}) {
    options.contact.classifier = {.threshold = 3.0 * subnormal, .ratio = ratio};
    const Estimate estimate = hard.expect_posterior(objects, options, all_touches(tiny));
    EXPECT_NE(estimate.mode.log_likelihood, 0.0) << "nothing was said";
    for (std::size_t i = 0; i < tiny.size(); ++i) {
      EXPECT_EQ(options.contact.classify(tiny.touch(i)),
                reference::classify(tiny.touch(i), options.contact));
    }
  }
  // Beside one reading of usual size, all of them are No Contact.
  options.contact.classifier = {};
  tiny.pressure[0] = 20.0;
  EXPECT_EQ(known_readings(tiny.touch(0), {}).size(), 36U);
  hard.expect_posterior(objects, options, all_touches(tiny));

  MapOptions map_options;
  map_options.classifier = {.threshold = 3.0 * subnormal, .ratio = 0.5};
  tiny.pressure[0] = 5.0 * subnormal;
  hard.expect_map(all_touches(tiny), map_options);
}

}  // namespace palpate::silent_touch_test
