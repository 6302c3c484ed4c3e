// The bounded posterior of objects that slip: what it has in common with the histogram, and its
// laws.

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "bins_by_definition.hpp"
#include "bounded/certified.hpp"
#include "bounded_set_up.hpp"
#include "estimation/bounded/checked_options.hpp"
#include "estimation/bounded/moving/moving_belief.hpp"
#include "estimation/known_elements.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::slipping_belief_test {

BoundedOptions slipping_options() {
  BoundedOptions options = small_options();
  options.slip_sd = {.mm = 0.8, .rad = 0.3};
  return options;
}

TEST(SlippingBelief, AgreesWithTheHistogram) {
  Device device = Device::open();
  const Recording recording = touches_of_l(4, 961);
  BoundedOptions options = slipping_options();
  options.none_weight = 2.0;
  options.evidence_nats = 1e-4;  // of "none of these", too
  for (const DisplacementSd& touch_sd : {DisplacementSd{}, DisplacementSd{.mm = 0.5, .rad = 0.2}}) {
    options.touch_sd = touch_sd;
    BoundedPosterior bounded(two_shapes(), options);
    PoseHistogram dense(device, two_shapes(), dense_options(options));
    for (std::size_t n = 1; n <= recording.size(); ++n) {
      bounded.update(recording.touch(n - 1));
      dense.update(recording.touch(n - 1));
      expect_as_dense(bounded, dense, n);
      EXPECT_NEAR(bounded.entropy(), dense.entropy(), 1e-3);
      const double ours = bounded.refine(bounded.estimate().mode).covariance[0];
      const double theirs = dense.refine(dense.estimate().mode).covariance[0];
      EXPECT_NEAR(ours, theirs, 1e-2 * theirs);
    }
  }
}

TEST(SlippingBelief, IsUniformBeforeTheFirstTouchAndAfterAReset) {
  const Recording recording = touches_of_l(2, 964);
  const BoundedOptions options = slipping_options();
  BoundedPosterior belief(two_shapes(), options);
  const auto expect_uniform = [&] {
    const double p = belief.estimate().identity[0];
    EXPECT_NEAR(p, 1.0 / 3.0, 1e-9) << "as the weights say";
    const double of_labels = -p * std::log(p) - (1.0 - p) * std::log(1.0 - p);
    const double of_bins = std::log(static_cast<double>(options.lattice.bins()));
    EXPECT_NEAR(belief.entropy(), of_labels + of_bins, 1e-6);
    const std::vector<double> theta = belief.marginals(0).theta;
    EXPECT_NEAR(*std::ranges::max_element(theta), *std::ranges::min_element(theta), 1e-9);
    EXPECT_GT(*std::ranges::min_element(theta), 0.0);
  };
  expect_uniform();
  belief.update(all_touches(recording));
  EXPECT_LT(belief.entropy(), 7.0);
  belief.reset();
  expect_uniform();
}

TEST(SlippingBelief, HoldsAfterMoreTouchesThanFloat64HasRangeFor) {
  Device device = Device::open();
  const Recording recording = touches_of_l(6, 961);
  const BoundedOptions options = slipping_options();
  BoundedPosterior bounded(two_shapes(), options);
  PoseHistogram dense(device, two_shapes(), dense_options(options));
  for (int round = 0; round < 25; ++round) {
    bounded.update(all_touches(recording));
    dense.update(all_touches(recording));
  }
  const Estimate ours = bounded.estimate();
  EXPECT_LT(ours.mode.log_likelihood, -800.0) << "or nothing is tested";
  EXPECT_LE(ours.certificate->dropped_mass, options.tolerance + 1e-7);
  EXPECT_LT(largest_difference(ours.identity, dense.estimate().identity), 1e-3);
  EXPECT_EQ(ours.mode.bin, dense.estimate().mode.bin);
}

TEST(SlippingBelief, TwinsShareTheModeWhichIsNotCertain) {
  const std::vector<Hypothesis> twins(2, two_shapes().front());
  BoundedPosterior belief(twins, slipping_options());
  belief.update(all_touches(touches_of_l(4, 965)));
  const Estimate estimate = belief.estimate();
  EXPECT_NEAR(estimate.identity[0], 0.5, 1e-5);
  EXPECT_FALSE(estimate.certificate->mode_certain);
  BoundedPosterior alone({&twins.front(), 1}, slipping_options());
  alone.update(all_touches(touches_of_l(4, 965)));
  EXPECT_TRUE(alone.estimate().certificate->mode_certain);
}

TEST(SlippingBelief, ListsTheBinsThatHaveMass) {
  BoundedPosterior belief(two_shapes(), slipping_options());
  belief.update(all_touches(touches_of_l(6, 961)));
  const double least = std::ranges::min(belief.evaluated_bins().log_likelihood);
  EXPECT_GT(least, -1e4) << "what bins hold that were seen by bounds alone is no likelihood";
}

TEST(SlippingBelief, PlansAsTheHistogram) {
  Device device = Device::open();
  const Recording recording = touches_of_l(3, 962);
  const BoundedOptions options = slipping_options();
  BoundedPosterior bounded(two_shapes(), options);
  PoseHistogram dense(device, two_shapes(), dense_options(options));
  bounded.update(all_touches(recording));
  dense.update(all_touches(recording));
  const std::vector<Pose> candidates{{{0.0, 0.0}, 0.0}, {{-4.0, 3.0}, 1.0}, {{400.0, 0.0}, 0.0}};
  const auto ours = bounded.expected_gain(candidates, digitacts_array(), {.samples = 1024});
  const auto theirs = dense.expected_gain(candidates, digitacts_array(), {.samples = 1024});
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    // Other draws of the same belief.
    EXPECT_NEAR(ours[i].pose, theirs[i].pose, 0.1 + 0.1 * theirs[i].pose);
  }
}

TEST(SlippingBelief, IsTheSameTouchByTouch) {
  const Recording recording = touches_of_l(5, 963);
  const std::vector<Touch> touches = all_touches(recording);
  BoundedOptions options = slipping_options();
  BoundedPosterior at_once(two_shapes(), options);
  at_once.update(touches);
  const auto expected = told_by(at_once, 2);
  options.threads = 1;
  BoundedPosterior one_by_one(two_shapes(), options);
  for (const Touch& touch : touches) {
    one_by_one.update(touch);
    one_by_one.sample(3, 1);
    one_by_one.estimate();
  }
  EXPECT_EQ(told_by(one_by_one, 2), expected);
  one_by_one.reset();
  one_by_one.update(touches);
  EXPECT_EQ(told_by(one_by_one, 2), expected);
}

TEST(SlippingBelief, IsCertifiedByATableAndForEveryLabel) {
  BoundedOptions options = slipping_options();
  options.evidence_nats = 1e-3;
  options.evidence_range_nats = 60.0;
  const Recording recording = random_recording(5, 20, 966);
  const std::vector<Touch> touches = all_touches(recording);
  expect_certified(two_made_up(), options, touches);
  options.contact.table = crooked_table();
  // Between likelihoods that lie thousands of nats apart, the place of a turned bin is not certain.
  for (double& nats : options.contact.table->log_likelihood) {
    nats = std::clamp(nats, -9.0, 0.0);
  }
  expect_certified(two_made_up(), options, touches);
}

TEST(SlippingBelief, RefinesAsTheHistogramOnBinsThatLieFarBelowTheMode) {
  Device device = Device::open();
  const Recording recording = touches_of_l(3, 967);
  BoundedOptions options = slipping_options();
  // A few wrong readings cost more nats than bins that are followed may lie below the belief.
  LikelihoodTable table{.first_log_odds = -4.0, .last_log_odds = 4.0, .nodes = 2};
  for (std::size_t level = 0; level < table.levels(); ++level) {
    table.log_likelihood.insert(table.log_likelihood.end(),
                                {level == 0 ? 0.0 : -30.0, level == 0 ? -30.0 : 0.0});
  }
  options.contact.table = table;
  // Slips that hardly reach another bin carry no belief from one to the other.
  for (const DisplacementSd& slip_sd : {DisplacementSd{1.0, 0.1}, DisplacementSd{0.3, 0.03}}) {
    options.slip_sd = slip_sd;
    BoundedPosterior bounded(two_shapes(), options);
    PoseHistogram dense(device, two_shapes(), dense_options(options));
    for (std::size_t n = 1; n <= recording.size(); ++n) {
      bounded.update(recording.touch(n - 1));
      dense.update(recording.touch(n - 1));
      SCOPED_TRACE(testing::Message() << n << " touches, slips of " << slip_sd.mm << " mm");
      ASSERT_EQ(bounded.estimate().mode.bin, dense.estimate().mode.bin);
      const RefinedPose ours = bounded.refine(bounded.estimate().mode);
      const RefinedPose theirs = dense.refine(dense.estimate().mode);
      for (std::size_t i = 0; i < ours.covariance.size(); ++i) {
        const double variances = theirs.covariance[i / 3 * 4] * theirs.covariance[i % 3 * 4];
        EXPECT_NEAR(ours.covariance[i], theirs.covariance[i], 1e-3 * std::sqrt(variances));
      }
    }
  }
}

TEST(SlippingBelief, SlipsByLittleAsIfAtRest) {
  const Recording recording = touches_of_l(4, 964);
  const std::vector<Touch> touches = all_touches(recording);
  BoundedOptions options = small_options();
  BoundedPosterior at_rest(two_shapes(), options);
  at_rest.update(touches);
  // A neighbouring bin is 20 deviations away or more: float64 holds no weight of it.
  options.slip_sd = {.mm = 0.01, .rad = 0.001};
  BoundedPosterior slips(two_shapes(), options);
  slips.update(touches);
  const Estimate still = at_rest.estimate();
  const Estimate slipping = slips.estimate();
  EXPECT_EQ(still.mode.bin, slipping.mode.bin);
  EXPECT_NEAR(still.mode.log_likelihood, slipping.mode.log_likelihood, 1e-6);
  EXPECT_LT(largest_difference(still.identity, slipping.identity), 3e-6);
}

TEST(SlippingBelief, ABudgetThatIsEnoughChangesNothing) {
  const Recording recording = touches_of_l(5, 966);
  BoundedOptions options = slipping_options();
  options.none_weight = 1.0;
  BoundedPosterior undisturbed(two_shapes(), options);
  options.budget_s = 1e6;
  BoundedPosterior timed(two_shapes(), options);
  for (std::size_t n = 1; n <= recording.size(); ++n) {
    undisturbed.update(recording.touch(n - 1));
    timed.update(recording.touch(n - 1));
    EXPECT_EQ(told_by(timed, 2), told_by(undisturbed, 2)) << n;
  }
}

/// So many bins that a search without time leaves most of them out.
BoundedOptions hurried_options() {
  BoundedOptions options = slipping_options();
  options.lattice.x_mm.count = options.lattice.y_mm.count = 60;
  options.slip_sd = {.mm = 3.0, .rad = 0.3};
  options.none_weight = 0.3;
  options.budget_s = 1e-9;
  return options;
}

TEST(SlippingBelief, WithoutTimeFollowsFewBinsAndKeepsItsLaws) {
  const Recording recording = touches_of_l(9, 966);
  BoundedOptions options = hurried_options();
  BoundedPosterior hurried(two_shapes(), options);
  options.budget_s.reset();
  BoundedPosterior undisturbed(two_shapes(), options);
  const auto fewest = std::int64_t{16} * (256 + 2 * 16);
  for (std::size_t n = 0; n < recording.size(); ++n) {
    hurried.update(recording.touch(n));
    undisturbed.update(recording.touch(n));
    const Estimate some = hurried.estimate();
    const Estimate all = undisturbed.estimate();
    EXPECT_LE(some.certificate->bins_evaluated, fewest);
    double sum_of_all = some.none;
    for (std::size_t i = 0; i < 2; ++i) {
      sum_of_all += some.identity[i];
      EXPECT_LE(some.identity_bounds[i].low, all.identity[i] + 1e-9);
      EXPECT_GE(some.identity_bounds[i].high, all.identity[i] - 1e-9);
    }
    EXPECT_NEAR(sum_of_all, 1.0, 1e-9) << "numbers, all of them";
    EXPECT_TRUE(std::isfinite(some.mode.log_likelihood));
    EXPECT_LT(some.none, 0.5) << "what was not looked at is no stranger";
    EXPECT_TRUE(std::isfinite(hurried.entropy()));
    EXPECT_NEAR(sum(hurried.marginals(0).theta), some.identity[0], 1e-6);
    EXPECT_TRUE(std::isfinite(hurried.refine(some.mode).covariance[0]));
    EXPECT_EQ(hurried.sample(20, 1).size(), 20U);
  }
  // The first touch left most out, and the certificate says so for the last, too.
  EXPECT_GT(hurried.estimate().certificate->dropped_mass,
            undisturbed.estimate().certificate->dropped_mass);
}

TEST(SlippingBelief, DrawsAndMarginalsOfACutShortBeliefBeginNoSearch) {
  const Recording recording = touches_of_l(2, 966);
  BoundedPosterior belief(two_shapes(), hurried_options());
  belief.update(all_touches(recording));
  const Certificate before = belief.estimate().certificate.value();
  const auto theta = belief.marginals(0).theta;
  belief.sample(20, 1);
  belief.entropy();
  belief.refined_blocks();
  EXPECT_EQ(belief.marginals(0).theta, theta);
  belief.reset();
  belief.update(all_touches(recording));
  EXPECT_EQ(belief.sample(20, 1).size(), 20U);
  const Certificate after = belief.estimate().certificate.value();
  EXPECT_EQ(after.bins_evaluated, before.bins_evaluated);
  EXPECT_EQ(after.dropped_mass, before.dropped_mass);
}

TEST(MovingBelief, MakesUpForWhatWasCutShortOnceThereIsTime) {
  const BoundedOptions options = checked(hurried_options(), two_shapes());
  const SearchSpace space(two_shapes(), options);
  const BinLikelihood likelihood(two_shapes(), options.contact, options.lattice);
  MovingBelief hurried(space, options, likelihood, two_shapes());
  MovingBelief undisturbed(space, options, likelihood, two_shapes());
  const Recording recording = touches_of_l(3, 966);
  for (const TouchEvidence& touch : evidence_of(all_touches(recording), options.contact)) {
    hurried.add(known_elements(touch, options));
    undisturbed.add(known_elements(touch, options));
  }
  const SearchResult cut_short = hurried.find({}, Deadline(1e-9));
  const SearchResult made_up = hurried.find({}, Deadline(1e6));
  const SearchResult all = undisturbed.find({}, Deadline({}));
  EXPECT_GT(cut_short.unproven(), made_up.unproven());
  EXPECT_EQ(made_up.unproven(), all.unproven());
  EXPECT_EQ(made_up.bins_evaluated, all.bins_evaluated) << "no deeper than is needed";
}

TEST(SlippingBelief, RefusesTooManyBins) {
  BoundedOptions options = slipping_options();
  options.lattice.x_mm.count = options.lattice.y_mm.count = options.lattice.theta_rad.count = 3000;
  EXPECT_THROW(BoundedPosterior(two_shapes(), options), Error);
}

TEST(SlippingBelief, StartsAnewAfterItWasCancelled) {
  const Recording recording = touches_of_l(4, 965);
  const std::vector<Touch> touches = all_touches(recording);
  BoundedOptions options = slipping_options();
  BoundedPosterior undisturbed(two_shapes(), options);
  undisturbed.update(touches);
  int left = 3;
  options.cancel_point = [&] {
    if (--left == 0) {
      throw std::runtime_error("enough");
    }
  };
  BoundedPosterior cancelled(two_shapes(), options);
  cancelled.update(touches);
  EXPECT_THROW(cancelled.estimate(), std::runtime_error);
  EXPECT_EQ(told_by(cancelled, 2), told_by(undisturbed, 2));
}

}  // namespace palpate::slipping_belief_test
