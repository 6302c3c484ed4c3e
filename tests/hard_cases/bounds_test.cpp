#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "hard_case.hpp"
#include "palpate/balanced_lattice.hpp"
#include "support/limits.hpp"

namespace palpate::bounds_test {

constexpr double most_finite = std::numeric_limits<double>::max();

/// Gives a filter the touches and expects finite numbers.
template <typename Filter>
Estimate expect_numbers(Filter& filter, std::span<const Touch> touches) {
  filter.reset();
  filter.update(touches);
  Estimate estimate = filter.estimate();
  EXPECT_NEAR(sum(estimate.identity) + estimate.none, 1.0, 1e-9);
  EXPECT_TRUE(is_finite(estimate.mode.T_object_robot));
  EXPECT_TRUE(std::isfinite(estimate.mode.log_likelihood));
  return estimate;
}

TEST(Bounds, OfMapsLatticesAndTouchesLeaveNumbers) {
  const Recording usual = random_recording(2, 36, 521);
  Recording far = usual;
  far.T_robot_sensor[0].translation_mm = {most_finite, -most_finite};
  far.T_robot_sensor[1] = {{1e300, 1e300}, 1e300};
  far.elements_mm[3] = {most_finite, most_finite};
  for (const double cell_mm : {least_length_mm, 0.5, most_length_mm}) {
    for (const double origin_mm : {-farthest_mm, 0.0}) {
      SCOPED_TRACE(::testing::Message() << cell_mm << " mm, from " << origin_mm << " mm");
      std::vector<Hypothesis> objects{{random_map(9, 7, 0.5, 12.0, 522), 1.0},
                                      {random_map(9, 7, 0.5, 12.0, 523), 1e-300}};
      for (Hypothesis& object : objects) {
        object.map.cell_mm = cell_mm;
        object.map.origin_mm = {origin_mm, origin_mm};
        object.map.log_odds[5] = 1e30F;
        object.map.log_odds[6] = -1e30F;
      }
      for (const PoseLattice& lattice :
           {PoseLattice{{-3, 3, 4}, {-3, 3, 3}, {0, 6, 3}, {}},
            PoseLattice{{-1e9, 1e9, 5}, {-1e9, 1e9, 3}, {1e9 - 6.0, 1e9, 3}, {1e9, -1e9}}}) {
        EXPECT_GE(balanced_lattice(lattice, objects, 10'000).lattice.bins(), 1);
        PoseHistogram histogram(shared_device(), objects, {.lattice = lattice, .none_weight = 1.0});
        ParticleOptions options{.particles = 200, .region = lattice};
        for (Axis* axis : {&options.region.x_mm, &options.region.y_mm}) {
          axis->upper = std::min(axis->upper, axis->lower + 1e5);
        }
        ParticleFilter filter(shared_device(), objects, options);
        for (const Recording& recording : {usual, far}) {
          expect_numbers(filter, all_touches(recording));
          expect_finite(histogram.refine(expect_numbers(histogram, all_touches(recording)).mode));
          for (const int object : {0, 1}) {
            EXPECT_TRUE(all_finite(histogram.log_likelihood(object)));
            EXPECT_TRUE(all_finite(histogram.marginals(object).xy));
          }
        }
      }
    }
  }
}

TEST(Bounds, WhatLiesBeyondThemOnBothSidesDoesNotMeet) {
  HardCase hard("an element and a lattice that are both further away than cells are counted");
  std::vector<Hypothesis> objects{{random_map(21, 21, 1e-3, 12.0, 524), 1.0},
                                  {random_map(21, 21, 1e-3, 12.0, 526), 1.0}};
  Recording recording = random_recording(1, 36, 525);
  const auto at = [](double x_mm) {
    return PoseLattice{{x_mm, x_mm, 1}, {0, 0, 1}, {0, 0, 1}, {}};
  };
  // The object lies at -1e6 mm, and the touch is 2e6 mm away from it: more than 1e9 cells.
  recording.T_robot_sensor[0] = {{3e6, 0.0}, 0.0};
  hard.expect_posterior(objects, {.lattice = at(-1e6)}, all_touches(recording));

  // The particle filter clamps places at 2^20 cells, here 524.288 mm. All particles have one pose.
  recording.T_robot_sensor[0] = {{530.0, 0.0}, 0.0};
  for (glm::dvec2& element : recording.elements_mm) {
    element *= 0.001;
  }
  ParticleFilter filter(
      shared_device(), objects,
      {.particles = 1000, .region = at(-524.288), .motion_mm = 0.0, .motion_rad = 0.0});
  filter.update(recording.touch(0));
  hard.expect("identity of particles off the map", std::abs(filter.estimate().identity[0] - 0.5),
              1e-5);
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

TEST(Bounds, TouchesEntirelyOffTheMap) {
  HardCase hard("touches entirely off the map, by 40 to 1e300 mm");
  HardCase particles("particles: all-Unknown touches, and touches off the map by 40 to 1e300 mm");
  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 426), 1.0},
                                        {random_map(25, 25, 0.5, 6.0, 427), 1.0}};
  for (const double away_mm : {40.0, 1e6, 1e12, 1e300}) {
    const Recording recording = moved(random_recording(3, 36, 428), {{away_mm, -away_mm}, 0.0});
    for (const double gamma : {0.1, 0.0}) {
      HistogramOptions options = small_options();
      options.contact.gamma = gamma;
      const Estimate estimate = hard.expect_posterior(objects, options, all_touches(recording));
      EXPECT_EQ(estimate.mode.bin, 0) << "all bins are alike";
      EXPECT_EQ(estimate.mode.object, 0);
      EXPECT_EQ(estimate.identity, (std::vector{0.5, 0.5}));
    }
    expect_alike(particles, recording);
  }
  Recording unknown = random_recording(5, 36, 504);
  unknown.pressure.assign(unknown.pressure.size(), ContactClassifier{}.threshold);
  EXPECT_NEAR(expect_alike(particles, unknown).estimate().identity[0], 0.5, 1e-12);
}

}  // namespace palpate::bounds_test
