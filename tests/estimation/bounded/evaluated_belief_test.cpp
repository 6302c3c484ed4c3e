// BoundedPosterior::evaluated_bins() against every bin in float64.

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bounded_set_up.hpp"
#include "support/certified.hpp"

namespace palpate::evaluated_belief_test {

/// The share of the belief over objects and bins that the evaluated bins leave to the others.
/// Expects their log-likelihoods to be those of float64.
double rest_of(const EvaluatedBelief& evaluated, const reference::Posterior& truth) {
  std::vector<double> all;
  for (std::size_t object = 0; object < truth.weight.size(); ++object) {
    for (const double nats : truth.log_likelihood[object]) {
      all.push_back(truth.weight[object] * std::exp(nats));
    }
  }
  const double total = sum(all);
  const std::size_t bins = truth.log_likelihood[0].size();
  for (std::size_t i = 0; i < evaluated.index.size(); ++i) {
    const auto place = static_cast<std::size_t>(evaluated.index[i]);
    EXPECT_NEAR(evaluated.log_likelihood[i], truth.log_likelihood[place / bins][place % bins],
                1e-9);
    all[place] = 0.0;
  }
  return sum(all) / total;
}

TEST(EvaluatedBelief, IsThatOfEveryBinButForTheRestThatItBounds) {
  BoundedOptions wide = small_options();  // mostly beyond the maps
  wide.lattice.x_mm = {-60.0, 60.0, 60};
  wide.none_weight = 3.0;
  const Recording recording = touches_of_l(3, 871);
  for (auto [name, options] : {std::pair{std::string("exact"), small_options()},
                               {"uncertain", uncertain_options()},
                               {"wide", wide}}) {
    for (std::size_t n = 1; n <= recording.size(); ++n) {
      const reference::Posterior truth =
          reference_posterior(two_shapes(), options, recording.touches(0, n));
      for (const double tolerance : {1e-6, 0.05}) {
        SCOPED_TRACE(testing::Message() << name << ", " << n << " touches, " << tolerance);
        options.tolerance = tolerance;
        BoundedPosterior bounded(two_shapes(), options);
        bounded.update(recording.touches(0, n));
        const EvaluatedBelief evaluated = bounded.evaluated_bins();
        const Certificate certificate = bounded.estimate().certificate.value();
        EXPECT_GE(std::ssize(evaluated.index), certificate.bins_evaluated);
        EXPECT_LT(std::ssize(evaluated.index), 2 * options.lattice.bins());
        EXPECT_TRUE(std::ranges::is_sorted(evaluated.index, std::ranges::less_equal{}));
        EXPECT_LE(rest_of(evaluated, truth), evaluated.rest_mass_bound + 1e-12);
        EXPECT_GE(evaluated.rest_mass_bound, certificate.dropped_mass);
        if (name != "wide") {
          EXPECT_LT(evaluated.rest_mass_bound, 1.1 * tolerance);
        }
      }
    }
  }
}

TEST(EvaluatedBelief, IsEmptyWhereEveryBinSeesThePrior) {
  BoundedPosterior bounded(two_shapes(), small_options());
  const Recording recording = moved(touches_of_l(1, 872), {{500.0, 0.0}, 0.0});
  bounded.update(recording.touch(0));
  const EvaluatedBelief evaluated = bounded.evaluated_bins();
  EXPECT_TRUE(evaluated.index.empty());
  EXPECT_EQ(evaluated.rest_mass_bound, 1.0);
}

}  // namespace palpate::evaluated_belief_test
