// A belief within other tolerances than the options', and one that is flat.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"

namespace palpate::bounded_belief_test {

TEST(BoundedBelief, IsFoundWithinAnotherToleranceUntilTheNextTouch) {
  const Recording recording = touches_of_l(2, 825);
  BoundedPosterior exactly(two_shapes(), small_options());
  exactly.update(recording.touch(0));
  const Estimate exact = exactly.estimate();
  const double exact_entropy = exactly.entropy();

  bool cancels = false;
  BoundedOptions options = small_options();
  options.cancel_point = [&] {
    if (cancels) {
      throw std::runtime_error("Ctrl-C");
    }
  };
  BoundedPosterior posterior(two_shapes(), options);
  posterior.update(recording.touch(0));
  const Estimate wide = posterior.estimate(0.05);
  EXPECT_LE(wide.certificate->dropped_mass, 0.05);
  EXPECT_LT(wide.certificate->bins_evaluated, exact.certificate->bins_evaluated / 2);
  EXPECT_EQ(wide.mode.bin, exact.mode.bin);
  EXPECT_NEAR(wide.identity[0], exact.identity[0], 0.05);
  // A wider one than was asked for needs no search, nor does what else is asked.
  const double wide_entropy = posterior.entropy();
  EXPECT_NE(wide_entropy, exact_entropy);
  cancels = true;
  EXPECT_EQ(posterior.estimate(0.1).identity, wide.identity);
  EXPECT_EQ(posterior.sample(10, 826).size(), 10U);
  EXPECT_THROW(posterior.estimate(), std::runtime_error);
  EXPECT_EQ(posterior.entropy(), wide_entropy) << "the belief stays as it was";
  cancels = false;

  EXPECT_EQ(posterior.estimate().certificate->bins_evaluated, exact.certificate->bins_evaluated);
  EXPECT_EQ(posterior.entropy(), exact_entropy);
  EXPECT_EQ(posterior.estimate(0.05).identity, exact.identity) << "what is closer stays";

  exactly.update(recording.touch(1));
  const double next_entropy = exactly.entropy();
  posterior.reset();
  posterior.update(recording.touch(0));
  posterior.estimate(0.05);
  posterior.update(recording.touch(1));
  EXPECT_EQ(posterior.entropy(), next_entropy) << "within the options' tolerance again";
  posterior.estimate(1e-9);
  posterior.reset();
  posterior.update(recording.touch(0));
  EXPECT_EQ(posterior.entropy(), exact_entropy);
}

TEST(BoundedBelief, IsKnownNoWorseAfterAnotherSearchThatABudgetEnds) {
  constexpr std::chrono::milliseconds budget(50);
  bool slow = false;
  BoundedOptions options = small_options();
  options.budget_s = std::chrono::duration<double>(budget).count();
  options.cancel_point = [&] {
    if (slow) {
      std::this_thread::sleep_for(budget);  // so that the search ends after its first step
    }
  };
  BoundedPosterior posterior(two_shapes(), options);
  posterior.update(touches_of_l(1, 825).touch(0));
  const double proven = posterior.estimate(0.05).certificate->dropped_mass;
  slow = true;
  EXPECT_LE(posterior.estimate().certificate->dropped_mass, proven);
}

TEST(BoundedBelief, OfAHundredMillionBinsBeforeAnyTouchIsFlat) {
  const BoundedOptions options{
      .lattice = {{-50.0, 50.0, 600}, {-50.0, 50.0, 500}, {0, two_pi, 180}, {}}};
  const BoundedPosterior posterior(two_shapes(), options);
  const Estimate estimate = posterior.estimate();
  EXPECT_NEAR(estimate.identity[0], 1.0 / 3.0, 1e-6);
  EXPECT_EQ(estimate.mode.log_likelihood, 0.0);
  EXPECT_LE(estimate.certificate->dropped_mass, options.tolerance);
  const PoseLattice grid{{-50.0, 50.0, 2}, {-50.0, 50.0, 2}, {0, two_pi, 3}, {}};
  const Marginals marginals = posterior.marginals(1, grid);
  EXPECT_LE(largest_difference(marginals.xy, std::vector<double>(4, 2.0 / 3.0 / 4.0)), 1e-6);
  EXPECT_LE(largest_difference(marginals.theta, std::vector<double>(3, 2.0 / 3.0 / 3.0)), 1e-6);
  // What is promised for a thousand million bins.
  EXPECT_LE(posterior.host_bytes(), std::uint64_t{256} << 20);
}

}  // namespace palpate::bounded_belief_test
