// What planned touches tell, by bounds: the numbers of the histogram.

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/touched_shape.hpp"

namespace palpate::bounded_gain_test {

const std::vector<Pose> candidates{{{0.0, 0.0}, 0.0},  {{-4.0, 3.0}, 1.0},  {{6.0, -2.0}, 2.0},
                                   {{3.0, 7.0}, -1.0}, {{-7.0, -6.0}, 0.5}, {{400.0, 0.0}, 0.0}};

/// The L and its mirror image, which one touch hardly tells apart.
const std::vector<Hypothesis>& two_alike() {
  static const std::vector<Hypothesis> two{{map_of(on_letter_l, "L"), 1.0},
                                           {map_of(
                                                [](const glm::dvec2& p_mm) {
                                                  return on_letter_l({-p_mm.x, p_mm.y});
                                                },
                                                "J"),
                                            2.0}};
  return two;
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
  BoundedOptions uncertain = small_options();
  uncertain.touch_sd = {.mm = 1.0, .rad = 0.2};
  BoundedOptions learned = small_options();
  learned.contact.table = three_levels();
  learned.none_weight = 2.0;
  for (const auto& [name, options] :
       {std::pair{"exact", small_options()}, {"uncertain", uncertain}, {"learned", learned}}) {
    BoundedPosterior bounded(two_alike(), options);
    PoseHistogram dense(device, two_alike(),
                        {.lattice = options.lattice,
                         .contact = options.contact,
                         .none_weight = options.none_weight,
                         .touch_sd = options.touch_sd});
    const Recording recording = touches_of_l(2, 861);
    bounded.update(recording.touch(0));
    dense.update(recording.touch(0));
    bounded.estimate();  // as a plan asks first
    const Gains ours = gains_of(bounded);
    const Gains theirs = gains_of(dense);
    for (std::size_t i = 0; i < ours.mean.size(); ++i) {
      const double error = std::sqrt(ours.variance[i] + theirs.variance[i]);
      // Four standard errors: the draws are not the same.
      EXPECT_NEAR(ours.mean[i], theirs.mean[i], 4.0 * error + 1e-6) << name << ", " << i;
      EXPECT_LT(error, 0.03) << "or the test would see nothing";
    }
    const auto most = [](const Gains& gains, std::size_t from) {
      const auto first = gains.mean.begin() + static_cast<std::ptrdiff_t>(from);
      return *std::max_element(first, first + static_cast<std::ptrdiff_t>(candidates.size()));
    };
    EXPECT_GT(most(theirs, 0), 0.1) << name << ": identities";
    EXPECT_GT(most(theirs, candidates.size()), 1.0) << name << ": poses";
    EXPECT_NEAR(bounded.entropy(), dense.entropy(), 1e-3) << name;
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

TEST(BoundedGain, RefusesWhatTheHistogramRefuses) {
  const BoundedPosterior bounded(two_shapes(), small_options());
  const std::vector<glm::dvec2> array = digitacts_array();
  expect_refused([&] { bounded.expected_gain({}, array); }, "no candidate");
  expect_refused([&] { bounded.expected_gain(candidates, {}); }, "no living element");
  expect_refused([&] { bounded.expected_gain(candidates, array, {.samples = 1}); }, "samples = 1");
  expect_refused([&] { bounded.expected_gain(candidates, array, {.label_of = {0}}); }, "label_of");
}

}  // namespace palpate::bounded_gain_test
