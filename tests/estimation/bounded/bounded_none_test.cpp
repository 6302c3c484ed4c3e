// "None of these" of the bounded posterior: how closely it is bounded, and where a search ends
// early.

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"
#include "estimation/log_sum.hpp"

namespace palpate::bounded_none_test {

BoundedOptions with_none(double none_weight, int x = 13, int y = 12, int theta = 16) {
  BoundedOptions options = small_options();
  options.none_weight = none_weight;
  options.lattice.x_mm.count = x;
  options.lattice.y_mm.count = y;
  options.lattice.theta_rad.count = theta;
  return options;
}

Estimate estimate_of(const std::vector<Hypothesis>& objects, const BoundedOptions& options,
                     const Recording& recording) {
  BoundedPosterior posterior(objects, options);
  posterior.update(all_touches(recording));
  return posterior.estimate();
}

double none_width(const Estimate& estimate) {
  const LogInterval none = estimate.certificate->none_log_evidence.value();
  return none.high - none.low;
}

TEST(BoundedNone, AndTheMarginalsOfAllObjectsAreTheWhole) {
  BoundedPosterior posterior(two_shapes(), with_none(2.0));
  posterior.update(all_touches(touches_of_l(4, 816)));
  EXPECT_NEAR(
      posterior.estimate().none + sum(posterior.marginals(0).xy) + sum(posterior.marginals(1).xy),
      1.0, 1e-12);
}

TEST(BoundedNone, IsBoundedAsCloselyAsTheEvidenceAndWithin0_3Nats) {
  struct Row {
    double weight;
    std::optional<double> evidence_nats;
    double least;  ///< width in nats
    double most;
  };
  for (const Row& row : {Row{1e-12, {}, 1e-4, infinity},  // which no identity asks for
                         Row{1e-12, 1e-4, 0.0, 1e-4}, Row{1.0, 0.01, 0.0, 0.01},
                         Row{1.0, 3.0, 0.0, 0.3}, Row{3.0, {}, 0.0, 0.3}}) {
    SCOPED_TRACE(testing::Message() << "weight " << row.weight);
    BoundedOptions options = with_none(row.weight, 30, 30);
    options.evidence_nats = row.evidence_nats;
    const Estimate estimate = estimate_of(two_made_up(), options, random_recording(1, 36, 820));
    EXPECT_GE(none_width(estimate), row.least);
    EXPECT_LE(none_width(estimate), row.most);
    const Certificate& certificate = estimate.certificate.value();
    const LogInterval none = *certificate.none_log_evidence;
    for (std::size_t i = 0; i < 2; ++i) {
      const auto [own_low, own_high] = certificate.log_evidence[i];
      const auto [other_low, other_high] = certificate.log_evidence[1 - i];
      const auto [low, high] = estimate.identity_bounds[i];
      EXPECT_LE(high - low, 0.3 / 4.0 + 4.0 * options.tolerance);
      // The least where all others have the most.
      EXPECT_LE(low, 1.0 / (1.0 + std::exp(log_add(other_high, none.high) - own_low)) + 1e-12);
      EXPECT_GE(high, 1.0 / (1.0 + std::exp(log_add(other_low, none.low) - own_high)) - 1e-12);
    }
  }
}

TEST(BoundedNone, CountsTheMemoryThatItTakes) {
  const auto bytes_of = [](const BoundedOptions& options) {
    BoundedPosterior posterior(two_made_up(), options);
    posterior.update(all_touches(random_recording(3, 36, 823)));
    posterior.estimate();
    return posterior.host_bytes();
  };
  // Of each touch, every object and theta has at least some numbers.
  const auto planes = static_cast<std::uint64_t>(2 * small_options().lattice.theta_rad.count);
  EXPECT_GT(bytes_of(with_none(1.0)), bytes_of(small_options()) + 3 * planes * sizeof(double));
}

TEST(BoundedNone, ShowsInTheIdentitiesWhereABudgetLeftIt) {
  BoundedOptions options = with_none(3.0, 90, 90, 20);
  const Recording recording = random_recording(1, 36, 819);
  const Estimate all = estimate_of(two_made_up(), options, recording);
  options.budget_s = 1e-9;
  const Estimate some = estimate_of(two_made_up(), options, recording);
  EXPECT_GT(none_width(some), 1e-3);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LE(some.identity_bounds[i].low, all.identity[i]);
    EXPECT_GE(some.identity_bounds[i].high, all.identity[i]);
  }
}

TEST(BoundedNone, KeepsItsPriorWhereABudgetToldNothing) {
  BoundedOptions options = with_none(1.0 / 3.0);  // beside weights of 1 and 2
  const Recording recording = touches_of_l(4, 821);
  EXPECT_LT(estimate_of(two_shapes(), options, recording).none, 0.01);
  options.budget_s = 1e-9;
  EXPECT_NEAR(estimate_of(two_shapes(), options, recording).none, 0.1, 1e-9);
}

TEST(BoundedNone, IsBelievedWhereASearchOfPoorFitsEndsEarly) {
  BoundedOptions options = with_none(1.0 / 3.0, 60, 60);
  options.poor_bins = 1;
  // Readings at random, which no pose explains.
  const Estimate estimate = estimate_of(two_shapes(), options, random_recording(6, 36, 829));
  EXPECT_GT(estimate.certificate->dropped_mass, 0.7) << "the search did not end early";
  EXPECT_GT(estimate.none, 0.99);
}

TEST(BoundedNone, LeavesObjectsAModeWhereItTakesAllOfTheMass) {
  const BoundedOptions options = with_none(1e300);
  BoundedPosterior posterior(two_made_up(), options);
  posterior.update(all_touches(random_recording(4, 36, 817)));
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
