// "None of these" against its definition in float64: the product of the touches' mean likelihoods.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <glm/geometric.hpp>

#include "touch_by_touch_data.hpp"

namespace palpate::none_evidence_test {

using NoneEvidence = TouchByTouchTest;

/// The share of an object's bins at which the array overlaps it.
double share_of_overlap(const Touch& touch, const PoseLattice& lattice, const OccupancyGrid& map) {
  std::int64_t bins = 0;
  for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
    bins += reference::overlaps(touch, reference::bin_pose(lattice, bin), map) ? 1 : 0;
  }
  return static_cast<double>(bins) / static_cast<double>(lattice.bins());
}

TEST_F(NoneEvidence, IsTheProductOfMeanLikelihoods) {
  // So far out that the array misses the objects at many bins.
  Recording far = recording;
  for (Pose& pose : far.T_robot_sensor) {
    pose.translation_mm = 0.3 * pose.translation_mm + glm::dvec2(17.0, 1.0);
  }
  const std::vector<Touch> some_miss = all_touches(far);
  for (const Hypothesis& object : two_maps()) {
    const double share = share_of_overlap(some_miss[0], small_lattice(), object.map);
    EXPECT_GT(share, 0.2);
    EXPECT_LT(share, 0.8);
  }
  for (const DisplacementSd& sd : {DisplacementSd{}, DisplacementSd{.mm = 1.0, .rad = 0.2}}) {
    for (const double gamma : {0.1, 0.0}) {
      HistogramOptions options{.lattice = small_lattice(), .none_weight = 3.0, .touch_sd = sd};
      options.contact.gamma = gamma;
      options.contact.prior = 0.2;
      PoseHistogram histogram(device, two_maps(), options);
      EXPECT_NEAR(histogram.estimate().none, 0.5, 1e-12);  // before any touch: W over all weights
      const std::vector<std::vector<Logs>> by_touch = reference_touches(options, some_miss);
      for (std::size_t n = 1; n <= some_miss.size(); ++n) {
        histogram.update(some_miss[n - 1]);
        EXPECT_NEAR(log_odds_of_none(histogram),
                    expected_log_odds_of_none(options, std::span(some_miss).first(n), by_touch),
                    (gamma > 0.0 ? per_mean : 5e-3) * static_cast<double>(n));
      }
    }
  }
}

TEST_F(NoneEvidence, IsDeafToATouchWithoutAKnownElement) {
  // Vulkan's exp(), which the device sums, is exact to a few units of float32's last place.
  constexpr double exp_error = 1e-6;
  const std::vector<std::uint8_t> dead(touches[0].elements_mm.size(), 0);
  Touch silent = touches[0];
  silent.T_robot_sensor.translation_mm += glm::dvec2(100.0, 0.0);
  silent.valid = dead;
  const HistogramOptions options{.lattice = small_lattice(), .none_weight = 3.0};
  PoseHistogram histogram(device, two_maps(), options);
  PoseHistogram without(device, two_maps(), options);
  histogram.update(silent);
  EXPECT_NEAR(histogram.estimate().none, 0.5, exp_error);
  for (const Touch& touch : touches) {
    histogram.update(touch);
    histogram.update(silent);
    without.update(touch);
  }
  EXPECT_NEAR(histogram.estimate().none, without.estimate().none, exp_error);
}

TEST_F(NoneEvidence, LeavesSamplesOfTheObjectsWhereNoneTakesAllOfTheMass) {
  HistogramOptions options{.lattice = small_lattice(), .none_weight = 1e300};
  PoseHistogram histogram(device, two_maps(), options);
  options.none_weight.reset();
  PoseHistogram without(device, two_maps(), options);
  // Weights of 1e300 alone leave the objects 1e-300; touches that share no object do the rest.
  for (int round = 0; round < 8; ++round) {
    histogram.update(touches);
    without.update(touches);
  }
  ASSERT_EQ(histogram.estimate().none, 1.0);
  EXPECT_NEAR(histogram.entropy(), without.entropy(), 1e-2);
  const std::vector<PoseSample> drawn = histogram.sample(64, 5);
  const std::vector<PoseSample> expected = without.sample(64, 5);
  ASSERT_EQ(drawn.size(), expected.size());
  int other_object = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    other_object += drawn[i].object != expected[i].object ? 1 : 0;
    EXPECT_LT(glm::length(drawn[i].T_object_robot.translation_mm), 30.0);
  }
  EXPECT_LE(other_object, 1);
}

TEST_F(NoneEvidence, TakesAllBinsWhereTheArrayMeetsNoObject) {
  HistogramOptions options{.lattice = small_lattice(), .none_weight = 3.0};
  Recording far = recording;
  for (Pose& pose : far.T_robot_sensor) {
    pose.translation_mm += glm::dvec2(100.0, 0.0);
  }
  PoseHistogram histogram(device, two_maps(), options);
  histogram.update(all_touches(far));
  // Every bin of every object sees nothing but the prior: nobody is favoured.
  EXPECT_NEAR(histogram.estimate().none, 0.5, 1e-6);
}

}  // namespace palpate::none_evidence_test
