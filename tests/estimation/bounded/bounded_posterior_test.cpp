// The bounded posterior against the dense one.

#include "palpate/bounded_posterior.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/certified.hpp"

namespace palpate::bounded_posterior_test {

TEST(BoundedPosterior, AgreesWithTheDenseHistogram) {
  Device device = Device::open();
  const Recording recording = touches_of_l(6, 803);
  for (const double gamma : {0.1, 0.0}) {
    for (const std::size_t touches : {0U, 1U, 2U, 6U}) {
      SCOPED_TRACE(::testing::Message() << touches << " touches, gamma " << gamma);
      BoundedOptions options = small_options();
      options.contact.gamma = gamma;
      BoundedPosterior bounded(two_shapes(), options);
      PoseHistogram dense(device, two_shapes(),
                          {.lattice = options.lattice, .contact = options.contact});
      bounded.update(recording.touches(0, touches));
      dense.update(recording.touches(0, touches));
      const Estimate ours = bounded.estimate();
      const Estimate theirs = dense.estimate();
      // The dense engine's rounding: 1e-4 nats per touch, of which a float32 sum's 2e-6 remains
      // where nothing was touched; gamma = 0 makes it relative, of at most 300 nats a touch.
      const double nats = per_touch * static_cast<double>(touches);
      const double allowed = options.tolerance + 2e-6 + 2.0 * nats;
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(ours.identity[i], theirs.identity[i], allowed);
        const Marginals a = bounded.marginals(static_cast<int>(i));
        const Marginals b = dense.marginals(static_cast<int>(i));
        EXPECT_LE(largest_difference(a.xy, b.xy), allowed);
        EXPECT_LE(largest_difference(a.theta, b.theta), allowed);
      }
      EXPECT_NEAR(ours.mode.log_likelihood, theirs.mode.log_likelihood, nats);
      EXPECT_EQ(ours.contradicted, theirs.contradicted);
      if (touches == 6) {  // fewer leave ties
        EXPECT_EQ(ours.mode.object, theirs.mode.object);
        EXPECT_EQ(ours.mode.bin, theirs.mode.bin);
        EXPECT_EQ(ours.mode.T_object_robot.theta_rad, theirs.mode.T_object_robot.theta_rad);
      }
      const RefinedPose a = bounded.refine(theirs.mode);
      const RefinedPose b = dense.refine(theirs.mode);
      // Logs that are 1e-4 nats off per touch move a mean within 2.5 mm by at most some 1e-3 mm.
      EXPECT_NEAR(a.T_object_robot.translation_mm.x, b.T_object_robot.translation_mm.x, 1e-3);
      EXPECT_NEAR(a.T_object_robot.translation_mm.y, b.T_object_robot.translation_mm.y, 1e-3);
      EXPECT_NEAR(a.T_object_robot.theta_rad, b.T_object_robot.theta_rad, 1e-3);
      for (std::size_t k = 0; k < 9; ++k) {
        EXPECT_NEAR(a.covariance[k], b.covariance[k],
                    1e-9 + 1e-3 * std::max(b.covariance[4 * (k / 3)], b.covariance[4 * (k % 3)]));
      }
    }
  }
}

TEST(BoundedPosterior, BeforeAnyTouchKnowsTheWeights) {
  BoundedPosterior posterior(two_made_up(), small_options());
  const Estimate estimate = posterior.estimate();
  EXPECT_NEAR(estimate.identity[0], 0.25, 1e-12);
  EXPECT_NEAR(estimate.identity[1], 0.75, 1e-12);
  EXPECT_EQ(estimate.mode.log_likelihood, 0.0);
  EXPECT_FALSE(estimate.contradicted);
  expect_certified(two_made_up(), small_options(), {});
}

TEST(BoundedPosterior, TellsTheLogLikelihoodOfPosesOffTheLattice) {
  const Recording recording = random_recording(4, 36, 804);
  BoundedPosterior posterior(two_made_up(), small_options());
  posterior.update(all_touches(recording));
  Uniform random(805);
  for (int i = 0; i < 100; ++i) {
    const Pose pose{{random(-40.0, 40.0), random(-40.0, 40.0)}, random(-9.0, 9.0)};
    const int object = i % 2;
    double expected = 0.0;
    for (const Touch& touch : all_touches(recording)) {
      expected += reference::log_likelihood(touch, pose, two_made_up()[i % 2].map, {});
    }
    EXPECT_NEAR(posterior.log_likelihood(object, pose), expected, 1e-10) << "rounding of 144 terms";
  }
  expect_refused([&] { posterior.log_likelihood(2, {}); }, "object 2");
  expect_refused([&] { posterior.log_likelihood(-1, {}); }, "object -1");
  expect_refused([&] { posterior.log_likelihood(0, {{nan, 0.0}, 0.0}); }, "finite");
}

TEST(BoundedPosterior, TellsMarginalsOnAnyGrid) {
  const Recording recording = touches_of_l(2, 806);
  const BoundedOptions options = small_options();
  BoundedPosterior posterior(two_shapes(), options);
  posterior.update(all_touches(recording));
  const reference::Posterior truth =
      reference_posterior(two_shapes(), options, all_touches(recording));
  const Certificate certificate = posterior.estimate().certificate.value();
  // Coarser, and over a part of the region: what lies outside counts at its border.
  const PoseLattice grid{.x_mm = {-4.0, 6.0, 3},
                         .y_mm = {-6.0, 6.0, 2},
                         .theta_rad = {0, two_pi, 4},
                         .pivot_mm = options.lattice.pivot_mm};
  const double log_total = [&] {
    double sum = 0.0;
    for (std::size_t i = 0; i < 2; ++i) {
      for (const double l : truth.log_likelihood[i]) {
        sum += truth.weight[i] * std::exp(l);
      }
    }
    return std::log(sum);
  }();
  for (int object = 0; object < 2; ++object) {
    const auto i = static_cast<std::size_t>(object);
    std::vector<double> xy(6, 0.0);
    std::vector<double> theta(4, 0.0);
    for (std::size_t bin = 0; bin < truth.log_likelihood[i].size(); ++bin) {
      const double p =
          std::exp(std::log(truth.weight[i]) + truth.log_likelihood[i][bin] - log_total);
      const std::int64_t at =
          grid.bin_of(reference::bin_pose(options.lattice, static_cast<std::int64_t>(bin)));
      xy[static_cast<std::size_t>(at % 6)] += p;
      theta[static_cast<std::size_t>(at / 6)] += p;
    }
    const Marginals marginals = posterior.marginals(object, grid);
    EXPECT_EQ(marginals.grid.x_mm.count, 3);
    EXPECT_LE(largest_difference(marginals.xy, xy), certificate.dropped_mass + 1e-9);
    EXPECT_LE(largest_difference(marginals.theta, theta), certificate.dropped_mass + 1e-9);
  }
  expect_refused([&] { posterior.marginals(2); }, "object 2");
  PoseLattice reversed = grid;
  reversed.x_mm = {1.0, -1.0, 3};
  expect_refused([&] { posterior.marginals(0, reversed); }, "reversed");
}

/// Elements in contact where all cells of a map have the same log odds.
struct Contradiction {
  int side = 0;           ///< of the square of elements
  float heavy = 0.0F;     ///< log odds that contradict the touch by more than 700 nats
  float light = 0.0F;     ///< log odds that contradict it by less
  float as_heavy = 0.0F;  ///< log odds that contradict it by more than 700 nats, too
};

TEST(BoundedPosterior, IsContradictedWhereTheDenseOneIs) {
  Device device = Device::open();
  // By few elements beyond what a tile's penalties hold, and by many within it.
  for (const Contradiction& by :
       {Contradiction{2, -500.0F, -150.0F, -400.0F}, Contradiction{9, -12.0F, -8.0F, -11.0F}}) {
    std::vector<Hypothesis> objects{{random_map(61, 61, 0.5, 1.0, 814), 1.0},
                                    {random_map(61, 61, 0.5, 1.0, 815), 1.0}};
    const auto fill = [&](std::size_t object, float log_odds) {
      std::vector<float>& cells = objects[object].map.log_odds;
      std::fill(cells.begin(), cells.end(), log_odds);
    };
    Recording recording;
    for (int i = 0; i < by.side * by.side; ++i) {
      recording.elements_mm.emplace_back(0.2 * (i % by.side), 0.2 * (i / by.side));
      recording.pressure.push_back(9.0);
    }
    recording.T_robot_sensor = {{}};
    BoundedOptions options = small_options();
    options.contact.gamma = 0.0;
    for (const double weight : {1.0, 1e-300}) {
      SCOPED_TRACE(::testing::Message() << by.side << " elements a side, weight " << weight);
      objects[1].weight = weight;
      const auto compare = [&](float light, bool contradicted) {
        fill(0, by.heavy);
        fill(1, light);
        BoundedPosterior bounded(objects, options);
        PoseHistogram dense(device, objects,
                            {.lattice = options.lattice, .contact = options.contact});
        bounded.update(all_touches(recording));
        dense.update(all_touches(recording));
        EXPECT_EQ(dense.estimate().contradicted, contradicted);
        EXPECT_EQ(bounded.estimate().contradicted, contradicted);
        EXPECT_EQ(bounded.estimate().mode.object, dense.estimate().mode.object);
      };
      compare(by.light, false);
      compare(by.as_heavy, true);
    }
  }
}

}  // namespace palpate::bounded_posterior_test
