#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/particle_filter.hpp"
#include "support/synthetic.hpp"
#include "weighed_particles.hpp"

namespace palpate::particle_weights_test {

TEST(ParticleWeights, WeighsAsTheReferenceDoesAtTheParticlesOwnPoses) {
  const std::vector<Hypothesis> objects = three_objects();
  Device device = Device::open();
  // Around blocks of 64 and 1,024.
  for (const int n : {1, 7, 63, 65, 1000, 1025, 5000}) {
    const ParticleOptions options{.particles = n, .region = {}};
    ParticleFilter filter(device, objects, options);
    const Recording recording = random_recording(3, 36, 433);
    for (std::size_t i = 0; i < recording.size(); ++i) {
      filter.update(recording.touch(i));
      EXPECT_LT(weight_error(filter, recording.touch(i), objects, options), per_touch)
          << n << " particles, touch " << i;
    }
  }
}

TEST(ParticleWeights, WeighsAsTheReferenceDoesOnLargeMapsAndAlienCells) {
  // 0.07 mm is no binary fraction, and 900 cells make float32 coordinates coarse.
  const std::vector<Hypothesis> objects = {{random_map(900, 700, 0.07, 4.0, 84), 1.0}};
  const ParticleOptions options{.particles = 3000, .region = {}};
  Device device = Device::open();
  ParticleFilter filter(device, objects, options);
  const Recording recording = random_recording(1, 36, 434);
  filter.update(recording.touch(0));
  EXPECT_LT(weight_error(filter, recording.touch(0), objects, options), per_touch);
}

TEST(ParticleWeights, WeighsAsTheReferenceDoesWithoutAFloorAndWithManyElements) {
  std::vector<Hypothesis> objects = three_objects();
  const Recording recording = random_recording(1, 10'000, 435);
  Device device = Device::open();
  for (const double gamma : {0.0, 0.1}) {
    const ParticleOptions options{.particles = 65, .region = {}, .contact = {.gamma = gamma}};
    ParticleFilter filter(device, objects, options);
    filter.update(recording.touch(0));
    // Weights below exp(-745) are 0 in float64: compare what is left, at least the largest.
    const auto particles = filter.particles();
    std::vector<double> logs;
    for (const auto& particle : particles) {
      logs.push_back(reference::log_likelihood(recording.touch(0), particle.T_object_robot,
                                               objects[particle.object].map, options.contact));
    }
    // 277 touches' worth of elements, and a probability changes by at most the error in nats.
    EXPECT_LT(largest_difference(weights_of(filter), reference::importance_weights(logs)),
              277 * per_touch)
        << gamma;
  }
}

TEST(ParticleWeights, KeepsItsPrecisionFarFromTheRobotsOrigin) {
  const std::vector<Hypothesis> objects = three_objects();
  ParticleOptions options{.particles = 1000, .region = {}};
  const Recording recording = random_recording(2, 36, 436);
  Device device = Device::open();
  ParticleFilter near(device, objects, options);
  near.update(all_touches(recording));

  const glm::dvec2 far_mm{1.2e6, -3.4e5};
  const Recording shifted = moved(recording, {far_mm, 0.0});
  options.region.pivot_mm = far_mm;
  ParticleFilter far(device, objects, options);
  far.update(all_touches(shifted));
  // 1 km away a float64 is good to 1e-10 mm, which may round float32 elements otherwise: a touch
  // differs by what the device may, and by the same draws.
  EXPECT_LT(largest_difference(weights_of(near), weights_of(far)), 2.0 * per_touch);
  EXPECT_LT(weight_error(far, shifted.touch(1), objects, options), per_touch);
  const Estimate here = near.estimate();
  const Estimate there = far.estimate();
  EXPECT_LT(largest_difference(here.identity, there.identity), 2.0 * per_touch);
  const glm::dvec2 p_mm{3.0, 4.0};
  EXPECT_NEAR((here.mode.T_object_robot * p_mm).x, (there.mode.T_object_robot * (p_mm + far_mm)).x,
              1e-6)
      << "the same grid point, in float64";
}

TEST(ParticleWeights, TheEffectiveSampleSizeIsThatOfTheWeights) {
  Device device = Device::open();
  const Recording recording = random_recording(3, 36, 439);
  for (const int n : {1, 65, 5000}) {
    ParticleFilter filter(device, three_objects(), {.particles = n, .region = {}});
    for (std::size_t i = 0; i < recording.size(); ++i) {
      filter.update(recording.touch(i));
      double squares = 0.0;
      for (const double weight : weights_of(filter)) {
        squares += weight * weight;
      }
      // Float32 sums within blocks.
      EXPECT_NEAR(filter.effective_sample_size(), 1.0 / squares, 1e-5 / squares);
    }
    EXPECT_GE(filter.effective_sample_size(), 1.0);
    EXPECT_LE(filter.effective_sample_size(), n);
  }
}

TEST(ParticleWeights, SumToOneHoweverFarApartTheyAre) {
  // One element, and a map that is sure of being empty but for a square millimetre: of a block of
  // 1,024 particles one or two are likely, and relative to any other the weights would be infinite.
  OccupancyGrid map{.label = "dot", .origin_mm = {-65.0, -65.0}, .nx = 261, .ny = 261};
  map.log_odds.assign(261 * 261, -1000.0F);
  for (const int cell : {130 * 261 + 130, 130 * 261 + 131, 131 * 261 + 130, 131 * 261 + 131}) {
    map.log_odds[static_cast<std::size_t>(cell)] = 1000.0F;
  }
  const std::vector<Hypothesis> objects{{map, 1.0}};
  const std::vector<glm::dvec2> element{{0.0, 0.0}};
  const std::vector<double> pressure_kpa{10.0};
  const Touch touch{.T_robot_sensor = {}, .elements_mm = element, .pressure = pressure_kpa};
  Device device = Device::open();
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    ParticleOptions options{.particles = 8192, .region = {}, .contact = {.gamma = 0.0}};
    options.region.x_mm = options.region.y_mm = {-25.0, 25.0};
    options.seed = seed;
    ParticleFilter filter(device, objects, options);
    filter.update(touch);
    double total = 0.0;
    for (const double weight : weights_of(filter)) {
      total += weight;
    }
    EXPECT_NEAR(total, 1.0, 1e-12) << "float64 sums";
    EXPECT_GE(filter.effective_sample_size(), 1.0);
    EXPECT_LE(filter.effective_sample_size(), 40.0) << "few are likely";
  }
}

TEST(ParticleWeights, WeightsSumToOneHoweverUnlikelyTheTouch) {
  // Without a floor, these log odds cost a touch some 1e4 nats.
  std::vector<Hypothesis> objects = {{random_map(200, 200, 0.5, 1.0, 85), 1.0}};
  for (float& l : objects[0].map.log_odds) {
    l = -1000.0F;
  }
  Device device = Device::open();
  ParticleOptions options{.particles = 2000, .region = {}, .contact = {.gamma = 0.0}};
  options.augmented = true;
  ParticleFilter filter(device, objects, options);
  const Recording recording = random_recording(3, 36, 440);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    filter.update(recording.touch(i));
    double total = 0.0;
    for (const double weight : weights_of(filter)) {
      total += weight;
    }
    EXPECT_NEAR(total, 1.0, 1e-12) << "float64 sums";
    EXPECT_NEAR(filter.effective_sample_size(), 2000.0, 0.1) << "all are as unlikely";
    EXPECT_TRUE(std::isfinite(filter.estimate().mode.log_likelihood));
  }
}

}  // namespace palpate::particle_weights_test
