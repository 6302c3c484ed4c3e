#include <cmath>

#include <gtest/gtest.h>

#include "hard_case.hpp"

namespace palpate::far_place_test {

/// Bins of 0.1 mm.
HistogramOptions fine_options() {
  return {.lattice = {{-1.0, 1.0, 20}, {-0.5, 0.5, 10}, {0, two_pi, 4}, {}}};
}

std::vector<Hypothesis> two_objects() {
  return {{random_map(61, 61, 0.5, 6.0, 441), 1.0}, {random_map(31, 31, 1.0, 6.0, 442), 1.0}};
}

TEST(FarPlace, PosesFarFromTheRobotsOrigin) {
  HardCase hard("poses 1e6 mm from the robot's origin, with a pivot, in bins of 0.1 mm");
  HardCase bounds("bounds: pivots 1e6 mm away, with and without the touches");
  HardCase particles("particles: 1e6 mm from the robot's origin, with a pivot, after 1e6 turns");
  const std::vector<Hypothesis> objects = two_objects();
  const Recording near = random_recording(4, 36, 443);
  PoseHistogram at_origin(hard.device(), objects, fine_options());
  at_origin.update(all_touches(near));
  for (const glm::dvec2 away_mm : {glm::dvec2(1e6, -1e6), glm::dvec2(-1e6, 0.0)}) {
    HistogramOptions options = fine_options();
    options.lattice.pivot_mm = away_mm;
    const Recording far = moved(near, {away_mm, 0.0});
    const Estimate estimate = hard.expect_posterior(objects, options, all_touches(far));
    EXPECT_EQ(estimate.mode.bin, at_origin.estimate().mode.bin);
    PoseHistogram far_away(hard.device(), objects, options);
    far_away.update(all_touches(far));
    hard.expect("against the same touches at the origin, nats",
                largest_difference(far_away.log_likelihood(0), at_origin.log_likelihood(0)), 1e-5);
    // 1e-10 mm of 1e6 mm are 2e-10 cells of 12 nats, times 150 elements and turns.
    bounds.expect_laws(objects, options, far, 1e-5);
    bounds.expect_laws(objects, options, near, 1e-5);  // far from the pivot: off the maps
    ParticleOptions about = two_thousand_particles(away_mm);
    about.region.theta_rad = {1e6 * two_pi, 1e6 * two_pi + two_pi, 1};
    EXPECT_NE(particles.expect_particles(objects, about, far).estimate().identity[0], 0.5)
        << "off the map";
  }
}

TEST(FarPlace, PosesFarAwayWithoutAPivot) {
  HardCase hard("objects 1e6 mm from the robot's origin, without a pivot");
  HardCase bounds("bounds: objects 1e6 mm from the robot's origin, without a pivot");
  const std::vector<Hypothesis> objects = two_objects();
  const Recording recording = moved(random_recording(4, 36, 444), {{1e6, -1e6}, 0.0});
  HistogramOptions options = fine_options();
  options.lattice.x_mm = {-1e6 - 1.0, -1e6 + 1.0, 20};
  options.lattice.y_mm = {1e6 - 0.5, 1e6 + 0.5, 10};
  options.lattice.theta_rad = {0.0, 0.0, 1};
  const Estimate estimate = hard.expect_posterior(objects, options, all_touches(recording));
  EXPECT_LT(std::abs(estimate.mode.T_object_robot.translation_mm.x + 1e6), 1.0);
  EXPECT_GT(std::abs(estimate.mode.log_likelihood), 1.0) << "off the map";
  bounds.expect_laws(objects, options, recording, 1e-5);
}

TEST(FarPlace, AnglesOfAMillionTurns) {
  HardCase hard("angles of 1e6 turns, of sensor and region");
  HardCase bounds("bounds: angles of 1e6 turns, of sensor and region");
  const std::vector<Hypothesis> objects = two_objects();
  const Recording once = random_recording(4, 36, 445);
  Recording turned = once;
  for (std::size_t i = 0; i < turned.size(); ++i) {
    turned.T_robot_sensor[i].theta_rad += (i % 2 == 0 ? 1e6 : -1e6) * two_pi;
  }
  HistogramOptions far = fine_options();
  far.lattice.theta_rad = {1e6 * two_pi, 1e6 * two_pi + two_pi, 4};
  const Estimate estimate = hard.expect_posterior(objects, far, all_touches(turned));
  EXPECT_EQ(estimate.mode.T_object_robot.theta_rad,
            far.lattice.T_object_robot(*estimate.mode.bin).theta_rad);
  PoseHistogram histogram(hard.device(), objects, far);
  histogram.update(all_touches(turned));
  PoseHistogram unturned(hard.device(), objects, fine_options());
  unturned.update(all_touches(once));
  EXPECT_EQ(estimate.mode.bin, unturned.estimate().mode.bin);
  hard.expect("against angles of one turn, nats",
              largest_difference(histogram.log_likelihood(0), unturned.log_likelihood(0)), 1e-5);
  bounds.expect_laws(objects, far, turned, 1e-5);
}

}  // namespace palpate::far_place_test
