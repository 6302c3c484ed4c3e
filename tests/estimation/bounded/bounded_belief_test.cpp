// A belief within other tolerances than the options', one that is flat, samples of beliefs, and
// what planned touches tell.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "bound_cases.hpp"
#include "support/touched_shape.hpp"

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

/// The share of draws in every (x, y) and theta of both objects, on small_options()' lattice.
struct Shares {
  explicit Shares(const std::vector<PoseSample>& draws) {
    const PoseLattice lattice = small_options().lattice;
    const auto plane = static_cast<std::size_t>(lattice.plane());
    xy.assign(2, std::vector<double>(plane));
    theta.assign(2, std::vector<double>(16));
    for (const PoseSample& draw : draws) {
      const auto bin = static_cast<std::size_t>(lattice.bin_of(draw.T_object_robot));
      xy[static_cast<std::size_t>(draw.object)][bin % plane] += 1.0 / std::ssize(draws);
      theta[static_cast<std::size_t>(draw.object)][bin / plane] += 1.0 / std::ssize(draws);
    }
  }
  std::vector<std::vector<double>> xy;
  std::vector<std::vector<double>> theta;
};

/// Draws to the bit.
std::vector<std::vector<double>> bits_of(const std::vector<PoseSample>& draws) {
  std::vector<std::vector<double>> bits;
  for (const PoseSample& draw : draws) {
    bits.push_back({static_cast<double>(draw.object), draw.T_object_robot.translation_mm.x,
                    draw.T_object_robot.translation_mm.y, draw.T_object_robot.theta_rad});
  }
  return bits;
}

TEST(DrawnBelief, IsDrawnFromInProportion) {
  BoundedOptions with_none = small_options();
  with_none.none_weight = 5.0;  // which draws leave out
  for (const BoundedOptions& options : {small_options(), with_none, uncertain_options()}) {
    BoundedPosterior posterior(two_shapes(), options);
    for (const std::size_t touches : {0U, 1U, 3U}) {
      SCOPED_TRACE(::testing::Message() << touches << " touches");
      posterior.reset();
      posterior.update(touches_of_l(3, 822).touches(0, touches));
      constexpr std::size_t count = 4000;
      const std::vector<PoseSample> draws = posterior.sample(count, 823);
      ASSERT_EQ(draws.size(), count);
      const Shares drawn(draws);
      const Estimate estimate = posterior.estimate();
      const double objects = sum(estimate.identity);
      for (std::size_t i = 0; i < 2; ++i) {
        // One draw in each of `count` equal parts of the belief.
        EXPECT_NEAR(sum(drawn.xy[i]), estimate.identity[i] / objects, 1.0 / count + 1e-6);
        const Marginals marginals = posterior.marginals(static_cast<int>(i));
        const auto expect_drawn = [&](const std::vector<double>& shares,
                                      const std::vector<double>& expected, double deviations) {
          for (std::size_t k = 0; k < shares.size(); ++k) {
            const double p = expected[k] / objects;
            EXPECT_NEAR(shares[k], p, deviations * std::sqrt(p / count) + 3.0 / count);
          }
        };
        expect_drawn(drawn.xy[i], marginals.xy, 5.0);
        // Draws come in the order of thetas: where all are alike, as many of each.
        expect_drawn(drawn.theta[i], marginals.theta, touches == 0 ? 0.0 : 5.0);
      }
      EXPECT_EQ(bits_of(posterior.sample(count, 823)), bits_of(draws));
      EXPECT_NE(bits_of(posterior.sample(count, 824)), bits_of(draws));
      EXPECT_TRUE(posterior.sample(0, 1).empty());
    }
  }
}

TEST(DrawnBelief, IsDrawnFromAllOverTheBins) {
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

const std::vector<Pose> candidates{{{0.0, 0.0}, 0.0},  {{-4.0, 3.0}, 1.0},  {{6.0, -2.0}, 2.0},
                                   {{3.0, 7.0}, -1.0}, {{-7.0, -6.0}, 0.5}, {{400.0, 0.0}, 0.0}};

/// The L and its mirror image, which one touch hardly tells apart.
std::vector<Hypothesis> two_alike() {
  const auto mirrored = [](const glm::dvec2& p_mm) { return on_letter_l({-p_mm.x, p_mm.y}); };
  return {{map_of(on_letter_l, "L"), 1.0}, {map_of(mirrored, "J"), 2.0}};
}

/// The gains of identity and of pose of every candidate, the means of 24 seeds.
template <typename Belief>
std::vector<double> gains_of(const Belief& belief) {
  constexpr int seeds = 24;
  std::vector<double> means(2 * candidates.size());
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const std::vector<TouchGain> gains =
        belief.expected_gain(candidates, digitacts_array(), {.seed = seed});
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      means[i] += gains[i].identity / seeds;
      means[candidates.size() + i] += gains[i].pose / seeds;
    }
  }
  return means;
}

/// Three levels that the log odds tell apart, but not surely.
LikelihoodTable three_levels() {
  LikelihoodTable table{.first_log_odds = -4.0, .last_log_odds = 4.0, .nodes = 9};
  table.level_edges = {6.0};
  for (const double slope : {-0.3, 0.05, 0.25}) {
    for (int node = 0; node < 9; ++node) {
      table.log_likelihood.push_back(slope * (node - 4.0) - 2.0);
    }
  }
  return table;
}

TEST(BoundedGain, IsThatOfTheHistogram) {
  BoundedOptions learned = small_options();
  learned.contact.table = three_levels();
  learned.none_weight = 2.0;
  for (const auto& [name, options] : {std::pair{"exact", small_options()},
                                      {"uncertain", uncertain_options()},
                                      {"learned", learned}}) {
    BothFilters both(two_alike(), options);
    both.update(touches_of_l(2, 861).touch(0));
    both.bounded.estimate();  // as a plan asks first
    const std::vector<double> ours = gains_of(both.bounded);
    const std::vector<double> theirs = gains_of(both.dense);
    // The draws are not the same: four standard errors, of 0.03 at most.
    EXPECT_LE(largest_difference(ours, theirs), 0.12) << name;
    const auto poses = theirs.begin() + std::ssize(candidates);
    EXPECT_GT(*std::max_element(theirs.begin(), poses), 0.1) << name << ": identities";
    EXPECT_GT(*std::max_element(poses, theirs.end()), 1.0) << name << ": poses";
    EXPECT_NEAR(both.bounded.entropy(), both.dense.entropy(), 1e-3) << name;
  }
}

}  // namespace palpate::bounded_belief_test
