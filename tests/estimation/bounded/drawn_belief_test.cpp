// Samples that are drawn from a bounded belief.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "bounded_set_up.hpp"
#include "support/certified.hpp"
#include "support/touched_shape.hpp"

namespace palpate::drawn_belief_test {

TEST(BoundedBelief, IsDrawnFromInProportion) {
  for (const bool none : {false, true}) {
    BoundedOptions options = small_options();
    if (none) {
      options.none_weight = 5.0;  // which draws leave out
    }
    BoundedPosterior posterior(two_shapes(), options);
    for (const std::size_t touches : {0U, 1U, 3U}) {
      SCOPED_TRACE(::testing::Message() << touches << " touches");
      posterior.reset();
      posterior.update(touches_of_l(3, 822).touches(0, touches));
      const Estimate estimate = posterior.estimate();
      constexpr std::size_t count = 4000;
      const std::vector<PoseSample> draws = posterior.sample(count, 823);
      ASSERT_EQ(draws.size(), count);
      const auto plane = static_cast<std::size_t>(options.lattice.plane());
      std::vector<std::vector<double>> xy(2, std::vector<double>(plane, 0.0));
      std::vector<std::vector<double>> theta(2, std::vector<double>(16, 0.0));
      for (const PoseSample& draw : draws) {
        const auto bin = static_cast<std::size_t>(options.lattice.bin_of(draw.T_object_robot));
        xy[static_cast<std::size_t>(draw.object)][bin % plane] += 1.0 / count;
        theta[static_cast<std::size_t>(draw.object)][bin / plane] += 1.0 / count;
      }
      const double objects = sum(estimate.identity);
      for (std::size_t i = 0; i < 2; ++i) {
        // One draw in each of `count` equal parts of the belief.
        EXPECT_NEAR(sum(xy[i]), estimate.identity[i] / objects, 1.0 / count + 1e-6);
        const Marginals marginals = posterior.marginals(static_cast<int>(i));
        const auto expect_drawn = [&](double drawn, double p) {
          EXPECT_NEAR(drawn, p, 5.0 * std::sqrt(p / count) + 2.0 / count);
        };
        for (std::size_t k = 0; k < plane; ++k) {
          expect_drawn(xy[i][k], marginals.xy[k] / objects);
        }
        for (std::size_t k = 0; k < 16; ++k) {
          expect_drawn(theta[i][k], marginals.theta[k] / objects);
        }
      }
      const std::vector<PoseSample> again = posterior.sample(count, 823);
      const std::vector<PoseSample> other = posterior.sample(count, 824);
      bool same = true;
      bool other_same = true;
      for (std::size_t i = 0; i < count; ++i) {
        const auto equal = [&](const PoseSample& a, const PoseSample& b) {
          return a.object == b.object &&
                 a.T_object_robot.translation_mm == b.T_object_robot.translation_mm &&
                 a.T_object_robot.theta_rad == b.T_object_robot.theta_rad;
        };
        same = same && equal(draws[i], again[i]);
        other_same = other_same && equal(draws[i], other[i]);
      }
      EXPECT_TRUE(same);
      EXPECT_FALSE(other_same);
      EXPECT_TRUE(posterior.sample(0, 1).empty());
    }
  }
}

TEST(BoundedBelief, IsDrawnFromEverywhereWhereNoTouchSeesAMap) {
  BoundedPosterior posterior(two_shapes(), small_options());
  Recording recording = touches_of_l(3, 829);
  for (Pose& pose : recording.T_robot_sensor) {
    pose.translation_mm += glm::dvec2(1e3, 0.0);
  }
  constexpr std::size_t count = 3000;
  for (std::size_t i = 0; i < recording.size(); ++i) {
    posterior.update(recording.touch(i));
    std::size_t of_the_first = 0;
    std::vector<std::size_t> thetas(16);
    for (const PoseSample& draw : posterior.sample(count, 830)) {
      of_the_first += draw.object == 0 ? 1 : 0;
      const std::int64_t bin = small_options().lattice.bin_of(draw.T_object_robot);
      ++thetas[static_cast<std::size_t>(bin / (13 * 12))];
    }
    EXPECT_NEAR(of_the_first, count / 3.0, 1.0) << "the prior weights";
    for (const std::size_t of_theta : thetas) {
      EXPECT_NEAR(of_theta, count / 16.0, 3.0);
    }
  }
}

TEST(BoundedBelief, IsDrawnFromAllOverTheBins) {
  BoundedPosterior posterior(two_shapes(), small_options());
  const PoseLattice& lattice = posterior.lattice();
  posterior.update(touches_of_l(2, 826).touches(0, 2));
  glm::dvec3 least(1.0);
  glm::dvec3 most(-1.0);
  for (const PoseSample& draw : posterior.sample(500, 827)) {
    const Pose centre = lattice.T_object_robot(lattice.bin_of(draw.T_object_robot));
    const glm::dvec2 off_mm = draw.T_object_robot * lattice.pivot_mm - centre * lattice.pivot_mm;
    const glm::dvec3 off(
        off_mm.x / lattice.x_mm.step(), off_mm.y / lattice.y_mm.step(),
        (draw.T_object_robot.theta_rad - centre.theta_rad) / lattice.theta_rad.step());
    least = glm::min(least, off);
    most = glm::max(most, off);
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LT(least[axis], -0.45) << "of half a step";
    EXPECT_GT(most[axis], 0.45);
  }
}

TEST(BoundedBelief, DrawnFromBeforeAnEstimateTellsTheSameAfterwards) {
  BoundedPosterior asked(two_shapes(), small_options());
  const Recording recording = touches_of_l(2, 823);
  for (const int what : {0, 1, 2}) {  // that is asked after the draws
    SCOPED_TRACE(what);
    asked.reset();
    asked.update(recording.touches(0, 2));
    const Estimate exact = asked.estimate();
    BoundedPosterior drawn(two_shapes(), small_options());
    drawn.update(recording.touches(0, 2));
    constexpr std::size_t count = 4000;
    double of_the_first = 0.0;
    for (const PoseSample& draw : drawn.sample(count, 824)) {
      of_the_first += draw.object == 0 ? 1.0 / count : 0.0;
    }
    if (what == 0) {
      const Estimate estimate = drawn.estimate();
      EXPECT_NEAR(of_the_first, exact.identity[0], 1e-6 + 1.0 / count);
      EXPECT_EQ(estimate.identity, exact.identity);
      EXPECT_EQ(estimate.certificate->dropped_mass, exact.certificate->dropped_mass);
      EXPECT_EQ(estimate.certificate->bins_evaluated, exact.certificate->bins_evaluated);
    } else if (what == 1) {
      EXPECT_EQ(drawn.marginals(0).xy, asked.marginals(0).xy);
    } else {
      EXPECT_EQ(drawn.entropy(), asked.entropy());
    }
  }
}

// Penalties of thousands of elements lie thousands of nats apart: more than weights hold.
TEST(BoundedBelief, IsDrawnFromWhateverTheNumberOfElements) {
  BoundedOptions options = small_options();
  const Recording recording = touches_of_l(6, 833);
  std::vector<glm::dvec2> elements_mm;
  std::vector<double> pressure;
  for (int copies = 0; copies < 60; ++copies) {  // each element is read again and again
    const Touch touch = recording.touch(0);
    elements_mm.insert(elements_mm.end(), touch.elements_mm.begin(), touch.elements_mm.end());
    pressure.insert(pressure.end(), touch.pressure.begin(), touch.pressure.end());
  }
  BoundedPosterior posterior(two_shapes(), options);
  for (int i = 0; i < 3; ++i) {
    posterior.update({.T_robot_sensor = recording.touch(0).T_robot_sensor,
                      .elements_mm = elements_mm,
                      .pressure = pressure});
  }
  const std::vector<PoseSample> draws = posterior.sample(64, 834);
  const Mode mode = posterior.estimate().mode;
  ASSERT_EQ(draws.size(), 64U);
  for (const PoseSample& draw : draws) {
    EXPECT_EQ(draw.object, mode.object);
    EXPECT_EQ(options.lattice.bin_of(draw.T_object_robot), mode.bin);
  }
}

}  // namespace palpate::drawn_belief_test
