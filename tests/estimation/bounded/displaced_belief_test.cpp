// The bounded posterior of touches of uncertain pose: what it has in common with the histogram, and
// its laws.

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "bins_by_definition.hpp"
#include "bounded_set_up.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/certified.hpp"

namespace palpate::displaced_belief_test {

BoundedOptions uncertain_options() {
  BoundedOptions options = small_options();
  options.touch_sd = {.mm = 1.0, .rad = 0.2};
  return options;
}

TEST(DisplacedBelief, AgreesWithTheHistogram) {
  Device device = Device::open();
  const Recording recording = touches_of_l(5, 951);
  BoundedOptions options = uncertain_options();
  options.none_weight = 2.0;
  options.evidence_nats = 1e-4;  // of "none of these", too
  BoundedPosterior bounded(two_shapes(), options);
  PoseHistogram dense(device, two_shapes(), dense_options(options));
  for (std::size_t n = 1; n <= recording.size(); ++n) {
    bounded.update(recording.touch(n - 1));
    dense.update(recording.touch(n - 1));
    expect_as_dense(bounded, dense, n);
  }
}

TEST(DisplacedBelief, DoesNotDependOnTheOrderOfTouches) {
  BoundedOptions options = uncertain_options();
  options.none_weight = 0.5;
  const Recording recording = touches_of_l(4, 952);
  const std::vector<Touch> touches = all_touches(recording);
  BoundedPosterior at_once(two_shapes(), options);
  at_once.update(touches);
  const auto expected = told_by(at_once, 2);
  options.threads = 1;
  BoundedPosterior one_by_one(two_shapes(), options);
  // The first touch stays the first: the share of "none of these" is the first one's.
  for (const std::size_t i : {0, 3, 1, 2}) {
    one_by_one.update(touches[i]);
    one_by_one.estimate();
    one_by_one.sample(3, i);
  }
  EXPECT_EQ(told_by(one_by_one, 2), expected);
  one_by_one.reset();
  one_by_one.update(touches);
  EXPECT_EQ(told_by(one_by_one, 2), expected);
}

TEST(DisplacedBelief, IsCertifiedByATableAndWithinBudgets) {
  BoundedOptions options = uncertain_options();
  const std::vector<Hypothesis>& objects = two_made_up();
  const Recording recording = random_recording(4, 20, 953);
  const std::vector<Touch> touches = all_touches(recording);
  for (const double budget_s : {1e-9, 1e-4, 1e-3, 10.0}) {
    options.budget_s = budget_s;
    expect_certified(objects, options, touches, 1e-9);
  }
  options.budget_s.reset();
  LikelihoodTable table = crooked_table();
  // Between likelihoods that lie thousands of nats apart, the place of a turned bin is not certain.
  for (double& nats : table.log_likelihood) {
    nats = std::clamp(nats, -9.0, 0.0);
  }
  options.contact.table = table;
  expect_certified(objects, options, touches, 1e-9);
}

TEST(DisplacedBelief, DrawsFromTheBelief) {
  // After one touch without a search, after three by one.
  const Recording recording = touches_of_l(3, 954);
  const std::vector<Touch> touches = all_touches(recording);
  for (const std::size_t count : {1U, 3U}) {
    BoundedPosterior posterior(two_shapes(), uncertain_options());
    posterior.update(std::span(touches).first(count));
    constexpr std::size_t draws = 4000;
    std::vector<double> drawn(16);
    double first = 0.0;
    for (const PoseSample& sample : posterior.sample(draws, 5)) {
      if (sample.object == 0) {
        const std::int64_t bin = posterior.lattice().bin_of(sample.T_object_robot);
        first += 1.0 / draws;
        drawn[static_cast<std::size_t>(bin / posterior.lattice().plane())] += 1.0 / draws;
      }
    }
    // One part in a hundred may be left out; 4,000 draws have a standard deviation below 0.008.
    EXPECT_NEAR(first, posterior.estimate().identity[0], 0.03);
    EXPECT_LT(largest_difference(drawn, posterior.marginals(0).theta), 0.03);
  }
}

}  // namespace palpate::displaced_belief_test
