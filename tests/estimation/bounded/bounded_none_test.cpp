// "None of these" of the bounded posterior.

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/sanitized.hpp"

namespace palpate::bounded_none_test {

TEST(BoundedPosterior, KnowsNoneOfThese) {
  Device device = Device::open();
  const Recording recording = touches_of_l(4, 816);
  BoundedOptions options = small_options();
  options.none_weight = 2.0;
  BoundedPosterior bounded(two_shapes(), options);
  PoseHistogram dense(device, two_shapes(), {.lattice = options.lattice, .none_weight = 2.0});
  EXPECT_NEAR(bounded.estimate().none, 0.4, 1e-12) << "2 of 1 + 2 + 2";
  for (std::size_t n = 1; n <= recording.size(); ++n) {
    bounded.update(recording.touch(n - 1));
    dense.update(recording.touch(n - 1));
    const Estimate ours = bounded.estimate();
    const Estimate theirs = dense.estimate();
    // 1e-3 nats per touch is what the method allows a float32 mean.
    const double error = 1e-3 * static_cast<double>(n);
    const double share = *theirs.none_log_evidence - theirs.log_evidence[0];
    const LogInterval none = ours.certificate->none_log_evidence.value();
    EXPECT_LE(none.low - ours.log_evidence[0], share + error);
    EXPECT_GE(none.high - ours.log_evidence[0], share - error);
    EXPECT_LE(none.low, *ours.none_log_evidence);
    EXPECT_GE(none.high, *ours.none_log_evidence);
    EXPECT_NEAR(sum(ours.identity) + ours.none, 1.0, 1e-12);
    double marginals = ours.none;
    for (int i = 0; i < 2; ++i) {
      marginals += sum(bounded.marginals(i).xy);
      const auto [low, high] = ours.identity_bounds[static_cast<std::size_t>(i)];
      EXPECT_LE(low, ours.identity[static_cast<std::size_t>(i)]);
      EXPECT_GE(high, ours.identity[static_cast<std::size_t>(i)]);
    }
    EXPECT_NEAR(marginals, 1.0, 1e-12);
    // Its odds against an object lie between those of the bounds of both their evidence.
    const auto [least, most] = ours.certificate->log_evidence[0];
    const auto [none_least, none_most] = ours.certificate->none_log_evidence.value();
    const double against = std::log(ours.identity[0]) - std::log(ours.none);
    EXPECT_GE(against, least - none_most - 1e-12);
    EXPECT_LE(against, most - none_least + 1e-12);
  }
  options.none_weight.reset();
  BoundedPosterior without(two_shapes(), options);
  without.update(all_touches(recording));
  const Estimate expected = without.estimate();
  const Estimate with = bounded.estimate();
  EXPECT_FALSE(expected.certificate->none_log_evidence);
  EXPECT_EQ(expected.none, 0.0);
  EXPECT_EQ(with.mode.bin, expected.mode.bin);
  EXPECT_NEAR(with.identity[0] / sum(with.identity), expected.identity[0], 2.0 * options.tolerance);
}

TEST(BoundedPosterior, BoundsNoneOfTheseBeyondAHundredThousandBins) {
  Device device = Device::open();
  BoundedOptions options = small_options();
  // Both objects together have 110,000.
  options.lattice.x_mm.count = 55;
  options.lattice.y_mm.count = 50;
  options.lattice.theta_rad.count = 20;
  options.none_weight = 3.0;
  for (const std::size_t elements : sanitized ? std::vector{36} : std::vector{36, 200}) {
    const Recording recording = random_recording(2, elements, 818);
    BoundedPosterior bounded(two_made_up(), options);
    PoseHistogram dense(device, two_made_up(), {.lattice = options.lattice, .none_weight = 3.0});
    for (std::size_t n = 1; n <= recording.size(); ++n) {
      SCOPED_TRACE(testing::Message() << elements << " elements, touch " << n);
      bounded.update(recording.touch(n - 1));
      dense.update(recording.touch(n - 1));
      const Estimate ours = bounded.estimate();
      const Estimate theirs = dense.estimate();
      // Its log odds are known within 0.3 nats, or to lie beyond 1 to 10,000.
      const LogInterval none = ours.certificate->none_log_evidence.value();
      const double objects = std::log(std::exp(ours.log_evidence[0] - none.low) +
                                      std::exp(ours.log_evidence[1] - none.low)) +
                             none.low;
      constexpr double negligible = 9.21;
      EXPECT_TRUE(none.high - none.low <= 0.3 || none.low > objects + negligible ||
                  none.high < objects - negligible)
          << none.low << " to " << none.high << " beside " << objects;
      // Shares of "none of these" that are near 1 leave the objects' digits. 1e-3 nats per touch is
      // what the method allows the dense one's float32 means.
      const double expected = *theirs.none_log_evidence - theirs.log_evidence[0];
      EXPECT_LE(none.low - ours.log_evidence[0], expected + 1e-3 * static_cast<double>(n));
      EXPECT_GE(none.high - ours.log_evidence[0], expected - 1e-3 * static_cast<double>(n));
      EXPECT_LE(none.low, *ours.none_log_evidence);
      EXPECT_GE(none.high, *ours.none_log_evidence);
      for (std::size_t i = 0; i < 2; ++i) {
        const ProbabilityInterval& p = ours.identity_bounds[i];
        EXPECT_LE(p.high - p.low, 0.3 / 4.0 + 4.0 * options.tolerance);
      }
    }
  }
}

TEST(BoundedPosterior, BoundsNoneOfTheseAsCloselyAsTheEvidenceIsAskedFor) {
  BoundedOptions options = small_options();
  options.none_weight = 1e-12;  // which no identity would ask for
  BoundedPosterior plain(two_made_up(), options);
  options.evidence_nats = 1e-4;
  BoundedPosterior close(two_made_up(), options);
  const auto width_of = [](const BoundedPosterior& posterior) {
    const LogInterval none = posterior.estimate().certificate->none_log_evidence.value();
    return none.high - none.low;
  };
  const Recording recording = random_recording(1, 36, 820);
  plain.update(all_touches(recording));
  close.update(all_touches(recording));
  EXPECT_GT(width_of(plain), 1e-4);
  EXPECT_LE(width_of(close), 1e-4);
}

TEST(BoundedPosterior, BoundsNoneOfTheseNoLessCloselyWhereLittleEvidenceIsAskedFor) {
  BoundedOptions options = small_options();
  options.none_weight = 1.0;
  const Recording recording = random_recording(3, 36, 820);
  for (const double nats : {0.01, 3.0}) {
    options.evidence_nats = nats;
    BoundedPosterior bounded(two_made_up(), options);
    bounded.update(all_touches(recording));
    const LogInterval none = bounded.estimate().certificate->none_log_evidence.value();
    EXPECT_LE(none.high - none.low, std::min(nats, 0.3));
  }
}

TEST(BoundedPosterior, CountsTheMemoryThatNoneOfTheseTakes) {
  BoundedOptions options = small_options();
  BoundedPosterior without(two_made_up(), options);
  options.none_weight = 1.0;
  BoundedPosterior with(two_made_up(), options);
  const Recording recording = random_recording(3, 36, 823);
  for (BoundedPosterior* posterior : {&without, &with}) {
    posterior->update(all_touches(recording));
    posterior->estimate();
  }
  // Of each touch, every object and theta has at least some numbers.
  const auto planes = static_cast<std::uint64_t>(2 * options.lattice.theta_rad.count);
  EXPECT_GT(with.host_bytes(), without.host_bytes() + 3 * planes * sizeof(double));
}

TEST(BoundedPosterior, ShowsInTheIdentitiesWhereABudgetLeftNoneOfThese) {
  BoundedOptions options = small_options();
  options.lattice.x_mm.count = 90;
  options.lattice.y_mm.count = 90;
  options.lattice.theta_rad.count = 20;
  options.none_weight = 3.0;
  BoundedPosterior sharp(two_made_up(), options);
  options.budget_s = 1e-9;
  BoundedPosterior ended(two_made_up(), options);
  const Recording recording = random_recording(1, 36, 819);
  sharp.update(all_touches(recording));
  ended.update(all_touches(recording));
  const Estimate all = sharp.estimate();
  const Estimate some = ended.estimate();
  EXPECT_GT(some.certificate->none_log_evidence->high - some.certificate->none_log_evidence->low,
            1e-3);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LE(some.identity_bounds[i].low, all.identity[i]);
    EXPECT_GE(some.identity_bounds[i].high, all.identity[i]);
  }
}

TEST(BoundedPosterior, LeavesNoneOfTheseItsPriorWhereABudgetToldNothing) {
  BoundedOptions options = small_options();
  options.none_weight = 1.0 / 3.0;  // beside weights of 1 and 2
  options.budget_s = 1e-9;
  BoundedPosterior posterior(two_shapes(), options);
  const Recording recording = touches_of_l(4, 821);
  posterior.update(all_touches(recording));
  const Estimate estimate = posterior.estimate();
  EXPECT_NEAR(estimate.none, 0.1, 1e-9);
  options.budget_s.reset();
  BoundedPosterior whole(two_shapes(), options);
  whole.update(all_touches(recording));
  EXPECT_LT(whole.estimate().none, 0.01);
}

TEST(BoundedPosterior, BelievesNoneOfTheseWhereASearchOfPoorFitsEndsEarly) {
  BoundedOptions options = small_options();
  options.lattice.x_mm.count = options.lattice.y_mm.count = 60;
  options.none_weight = 1.0 / 3.0;
  options.poor_bins = 1;
  BoundedPosterior posterior(two_shapes(), options);
  // Readings at random, which no pose explains.
  const Recording recording = random_recording(6, 36, 829);
  posterior.update(all_touches(recording));
  const Estimate estimate = posterior.estimate();
  EXPECT_GT(estimate.certificate->dropped_mass, 0.7) << "the search did not end early";
  EXPECT_GT(estimate.none, 0.99);
}

TEST(BoundedPosterior, LeavesObjectsWhereNoneTakesAllOfTheMass) {
  const Recording recording = random_recording(4, 36, 817);
  BoundedOptions options = small_options();
  options.none_weight = 1e300;
  BoundedPosterior posterior(two_made_up(), options);
  posterior.update(all_touches(recording));
  const Estimate estimate = posterior.estimate();
  EXPECT_EQ(estimate.none, 1.0);
  EXPECT_GE(estimate.certificate->dropped_mass, 0.0);
  EXPECT_LE(estimate.certificate->dropped_mass, options.tolerance);
  EXPECT_TRUE(estimate.mode.bin.has_value());
  for (const double p : posterior.marginals(0).xy) {
    EXPECT_TRUE(p >= 0.0 && p <= 1e-200);
  }
}

}  // namespace palpate::bounded_none_test
