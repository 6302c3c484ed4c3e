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

}  // namespace palpate::bounded_gain_test
