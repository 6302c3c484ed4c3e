#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "palpate/particle_filter.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate::particle_tracking_test {

std::vector<Hypothesis> letter_and_disc() {
  return {{map_of(on_letter_l, "L"), 1.0}, {map_of(on_disc, "disc"), 1.0}};
}

double error_mm(const Estimate& estimate, const Pose& truth) {
  return pose_error_mm(body_of(map_of(on_letter_l, "L")), 1, estimate.mode.T_object_robot, truth);
}

TEST(ParticleTracking, AgreesWithTheHistogramWhereThereIsNoNoise) {
  // After one touch and without motion, weighted uniform particles are an integral over the same
  // belief that the histogram sums over fine bins.
  const std::vector<Hypothesis> objects = letter_and_disc();
  Recording recording = touches_of(on_letter_l, {{3.0, -2.0}, 1.0}, 5, 461);
  // A quarter of the elements leaves the belief so broad that many particles count.
  for (std::size_t k = 0; k < recording.elements(); ++k) {
    recording.valid.push_back(k % 4 == 0 ? 1 : 0);
  }
  ParticleOptions particles{.particles = 100'000, .region = {}};
  particles.motion_mm = 0.0;
  particles.motion_rad = 0.0;
  HistogramOptions bins;
  bins.lattice.x_mm.count = 60;
  bins.lattice.y_mm.count = 60;
  bins.lattice.theta_rad.count = 60;
  Device device = Device::open();
  ParticleFilter filter(device, objects, particles);
  PoseHistogram histogram(device, objects, bins);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    filter.reset();
    histogram.reset();
    filter.update(recording.touch(i));
    histogram.update(recording.touch(i));
    // The variance of a share of the weights is at most that of a coin tossed as often as there are
    // effective particles.
    const double deviation = 0.5 / std::sqrt(filter.effective_sample_size());
    EXPECT_NEAR(filter.estimate().identity[0], histogram.estimate().identity[0], 4.0 * deviation)
        << "touch " << i;
    EXPECT_LT(deviation, 0.02) << "or this compares nothing";
  }
}

TEST(ParticleTracking, FindsTheObjectAndThePoseAsTheHistogramDoes) {
  const std::vector<Hypothesis> objects = letter_and_disc();
  const Pose truth{{-4.0, 2.5}, 4.0};
  const Recording recording = touches_of(on_letter_l, truth, 8, 462);
  Device device = Device::open();
  // The motion noise alone spreads particles over 1 mm and 0.1 rad, 0.6 mm at 6 mm.
  const auto expect_found = [&](auto filter) {
    filter.update(all_touches(recording));
    const Estimate estimate = filter.estimate();
    EXPECT_GT(estimate.identity[0], 0.99);
    EXPECT_EQ(estimate.mode.object, 0);
    EXPECT_LT(error_mm(estimate, truth), 1.5);
  };
  expect_found(PoseHistogram(device, objects, {}));
  for (const Resampling resampling : {Resampling::multinomial, Resampling::systematic}) {
    expect_found(ParticleFilter(device, objects,
                                {.particles = 20'000, .region = {}, .resampling = resampling}));
  }
}

TEST(ParticleTracking, RandomParticlesFindAnObjectThatWasTakenElsewhere) {
  const std::vector<Hypothesis> objects = letter_and_disc();
  const Pose first{{-6.0, -6.0}, 0.5};
  const Pose second{{7.0, 5.0}, 3.6};
  const Recording before = touches_of(on_letter_l, first, 8, 463);
  const Recording after = touches_of(on_letter_l, second, 25, 464);
  Device device = Device::open();
  for (const bool augmented : {false, true}) {
    ParticleOptions options{.particles = 5000, .region = {}};
    options.augmented = augmented;
    ParticleFilter filter(device, objects, options);
    filter.update(all_touches(before));
    EXPECT_LT(error_mm(filter.estimate(), first), 2.0);
    filter.update(all_touches(after));
    if (augmented) {
      EXPECT_LT(error_mm(filter.estimate(), second), 2.0);
    } else {
      EXPECT_GT(error_mm(filter.estimate(), second), 4.0) << "or there was nothing to recover from";
    }
  }
}

}  // namespace palpate::particle_tracking_test
