// BoundedPosterior::evaluated_bins() against every bin.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"
#include "palpate/bounded_posterior.hpp"
#include "palpate/pose_histogram.hpp"

namespace palpate::evaluated_belief_test {

/// The share of the belief over objects and bins that the evaluated bins leave to the others.
/// Expects their log-likelihoods to be those of the histogram.
double rest_of(const EvaluatedBelief& evaluated, const PoseHistogram& dense,
               std::span<const Hypothesis> objects) {
  std::vector<double> all;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t object = 0; object < objects.size(); ++object) {
    for (const double value : dense.log_likelihood(static_cast<int>(object))) {
      all.push_back(value + std::log(objects[object].weight));
      most = std::max(most, all.back());
    }
  }
  double total = 0.0;
  for (const double value : all) {
    total += std::exp(value - most);
  }
  const std::size_t bins = all.size() / objects.size();
  for (std::size_t i = 0; i < evaluated.index.size(); ++i) {
    const auto place = static_cast<std::size_t>(evaluated.index[i]);
    const double weight = std::log(objects[place / bins].weight);
    // What the method allows float32.
    EXPECT_NEAR(evaluated.log_likelihood[i] + weight, all[place], 1e-3);
    all[place] = -std::numeric_limits<double>::infinity();
  }
  double rest = 0.0;
  for (const double value : all) {
    rest += std::exp(value - most);
  }
  return rest / total;
}

TEST(EvaluatedBelief, IsThatOfEveryBinButForTheRestThatItBounds) {
  Device device = Device::open();
  BoundedOptions uncertain = small_options();
  uncertain.touch_sd = {.mm = 1.0, .rad = 0.2};
  BoundedOptions wide = small_options();  // mostly beyond the maps
  wide.lattice.x_mm = {-60.0, 60.0, 60};
  wide.none_weight = 3.0;
  const Recording recording = touches_of_l(3, 871);
  for (const auto& [name, given] :
       {std::pair{"exact", small_options()}, {"uncertain", uncertain}, {"wide", wide}}) {
    for (const double tolerance : {1e-6, 0.05}) {
      BoundedOptions options = given;
      options.tolerance = tolerance;
      BoundedPosterior bounded(two_shapes(), options);
      PoseHistogram dense(device, two_shapes(),
                          {.lattice = options.lattice, .touch_sd = options.touch_sd});
      for (std::size_t n = 0; n < recording.size(); ++n) {
        bounded.update(recording.touch(n));
        dense.update(recording.touch(n));
        const EvaluatedBelief evaluated = bounded.evaluated_bins();
        const Certificate certificate = bounded.estimate().certificate.value();
        EXPECT_GE(static_cast<std::int64_t>(evaluated.index.size()), certificate.bins_evaluated);
        EXPECT_LT(evaluated.index.size(), 2U * static_cast<std::size_t>(options.lattice.bins()));
        EXPECT_TRUE(std::ranges::is_sorted(evaluated.index, std::ranges::less_equal{}));
        const double rest = rest_of(evaluated, dense, two_shapes());
        // The histogram's rounding is 1e-4 of it.
        EXPECT_LE(rest, evaluated.rest_mass_bound + 1e-4 * rest + 1e-12) << name << ", " << n;
        EXPECT_GE(evaluated.rest_mass_bound, certificate.dropped_mass);
        if (std::string(name) != "wide") {
          EXPECT_LT(evaluated.rest_mass_bound, 1.1 * tolerance);
        }
      }
    }
  }
}

TEST(EvaluatedBelief, IsEmptyWhereEveryBinSeesThePrior) {
  Recording recording = touches_of_l(1, 872);
  recording.T_robot_sensor[0].translation_mm.x += 500.0;
  BoundedPosterior bounded(two_shapes(), small_options());
  bounded.update(recording.touch(0));
  const EvaluatedBelief evaluated = bounded.evaluated_bins();
  EXPECT_TRUE(evaluated.index.empty());
  EXPECT_EQ(evaluated.rest_mass_bound, 1.0);
}

}  // namespace palpate::evaluated_belief_test
