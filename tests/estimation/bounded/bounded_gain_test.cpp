// What planned touches tell, by bounds: the numbers of the histogram.

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"
#include "support/touched_shape.hpp"

namespace palpate::bounded_gain_test {

const std::vector<Pose> candidates{{{0.0, 0.0}, 0.0},  {{-4.0, 3.0}, 1.0},  {{6.0, -2.0}, 2.0},
                                   {{3.0, 7.0}, -1.0}, {{-7.0, -6.0}, 0.5}, {{400.0, 0.0}, 0.0}};

/// The L and its mirror image, which one touch hardly tells apart.
std::vector<Hypothesis> two_alike() {
  const auto mirrored = [](const glm::dvec2& p_mm) { return on_letter_l({-p_mm.x, p_mm.y}); };
  return {{map_of(on_letter_l, "L"), 1.0}, {map_of(mirrored, "J"), 2.0}};
}

/// Mean and variance of the mean of the gains over seeds, [identity of every candidate, pose].
struct Gains {
  std::vector<double> mean;
  std::vector<double> variance;
};
template <typename Belief>
Gains gains_of(const Belief& belief) {
  constexpr int seeds = 24;
  std::vector<double> sums(2 * candidates.size());
  std::vector<double> squares(sums.size());
  for (int seed = 0; seed < seeds; ++seed) {
    const std::vector<TouchGain> gains = belief.expected_gain(
        candidates, digitacts_array(), {.seed = static_cast<std::uint64_t>(seed)});
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const TouchGain& gain = gains[i % candidates.size()];
      const double value = i < candidates.size() ? gain.identity : gain.pose;
      sums[i] += value;
      squares[i] += value * value;
    }
  }
  Gains all;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double mean = sums[i] / seeds;
    all.mean.push_back(mean);
    all.variance.push_back(std::max(squares[i] / seeds - mean * mean, 0.0) / (seeds - 1));
  }
  return all;
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
  Device device = Device::open();
  BoundedOptions learned = small_options();
  learned.contact.table = three_levels();
  learned.none_weight = 2.0;
  for (const auto& [name, options] : {std::pair{"exact", small_options()},
                                      {"uncertain", uncertain_options()},
                                      {"learned", learned}}) {
    BothFilters both(device, two_alike(), options);
    both.update(touches_of_l(2, 861).touch(0));
    both.bounded.estimate();  // as a plan asks first
    const Gains ours = gains_of(both.bounded);
    const Gains theirs = gains_of(both.dense);
    for (std::size_t i = 0; i < ours.mean.size(); ++i) {
      const double error = std::sqrt(ours.variance[i] + theirs.variance[i]);
      // Four standard errors: the draws are not the same.
      EXPECT_NEAR(ours.mean[i], theirs.mean[i], 4.0 * error + 1e-6) << name << ", " << i;
      EXPECT_LT(error, 0.03) << "or the test would see nothing";
    }
    const auto poses = theirs.mean.begin() + std::ssize(candidates);
    EXPECT_GT(*std::max_element(theirs.mean.begin(), poses), 0.1) << name << ": identities";
    EXPECT_GT(*std::max_element(poses, theirs.mean.end()), 1.0) << name << ": poses";
    EXPECT_NEAR(both.bounded.entropy(), both.dense.entropy(), 1e-3) << name;
  }
}

TEST(BoundedGain, IsReproducibleBySeed) {
  BoundedPosterior bounded(two_shapes(), small_options());
  bounded.update(touches_of_l(1, 861).touch(0));
  const auto gain = [&](std::uint64_t seed) {
    return bounded.expected_gain(candidates, digitacts_array(), {.seed = seed})[1].both();
  };
  EXPECT_EQ(gain(3), gain(3));
  EXPECT_NE(gain(3), gain(4));
}

}  // namespace palpate::bounded_gain_test
