// The bins that a search evaluated: how they are kept, searched for again where there are too many,
// and told, against every bin.

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "estimation/bounded/bounded_belief.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/known_elements.hpp"
#include "palpate/bounded_posterior.hpp"
#include "support/certified.hpp"

namespace palpate::evaluated_bins_test {

TEST(EvaluatedBins, AreKeptAsLongAsThereIsRoom) {
  EvaluatedBins bins;
  for (int i = 0; i < 10; ++i) {  // 80 MiB hold ten times 8 MB
    bins.add({.y_count = 1000, .x_count = 1000}, std::vector<double>(1'000'000));
  }
  EXPECT_TRUE(bins.complete());
  EXPECT_GE(bins.bytes(), 80'000'000U);
  EXPECT_LE(bins.bytes(), std::uint64_t{160} << 20);
}

TEST(EvaluatedBins, BeyondTheirMemoryAreSearchedForAgain) {
  // 12 million bins, nearly all of which matter after one touch of three elements.
  const std::vector<Hypothesis> objects{{random_map(41, 37, 0.5, 2.0, 701), 1.0}};
  const BoundedOptions options{
      .lattice = {{-8.0, 8.0, 500}, {-8.0, 8.0, 500}, {0.0, two_pi, 48}, {}}};
  const std::vector<glm::dvec2> elements_mm{{-1.0, 0.0}, {0.3, 0.9}, {2.0, -1.0}};
  const std::vector<double> pressure{10.0, 0.0, 9.0};
  const Touch touch{.T_robot_sensor = {}, .elements_mm = elements_mm, .pressure = pressure};
  BoundedPosterior posterior(objects, options);
  posterior.update(touch);
  const Certificate certificate = posterior.estimate().certificate.value();
  ASSERT_GT(certificate.bins_evaluated, 10'600'000) << "80 MiB would hold them";
  EXPECT_LT(posterior.host_bytes(), std::uint64_t{80} << 20);

  const ContactModel contact{.prior = objects.front().map.prior};
  const KnownElements elements = known_elements(TouchEvidence(touch, contact), options);
  const BinLikelihood likelihood(objects, contact, options.lattice);
  std::vector<double> plane(static_cast<std::size_t>(options.lattice.plane()));
  std::vector<double> theta(48);
  for (std::size_t t = 0; t < theta.size(); ++t) {
    const BinBox box = whole_plane(options.lattice, static_cast<int>(t));
    likelihood.evaluate(std::span(&box, 1), elements, plane);
    theta[t] = std::transform_reduce(plane.begin(), plane.end(), 0.0, std::plus(),
                                     [](double nats) { return std::exp(nats); });
  }
  const double total = sum(theta);
  for (double& value : theta) {
    value /= total;
  }
  const Marginals marginals = posterior.marginals(0);
  EXPECT_LE(largest_difference(marginals.theta, theta), options.tolerance);
  EXPECT_NEAR(sum(marginals.xy), 1.0, 1e-9);

  std::vector<double> drawn(theta.size());
  for (const PoseSample& sample : posterior.sample(20'000, 702)) {
    const std::int64_t bin = options.lattice.bin_of(sample.T_object_robot);
    drawn[static_cast<std::size_t>(bin / options.lattice.plane())] += 1.0 / 20'000.0;
  }
  EXPECT_NEAR(sum(drawn), 1.0, 1e-9);
  // Five standard errors of the share of a theta, some 1/48.
  EXPECT_LE(largest_difference(drawn, theta), 5.0 * std::sqrt(1.0 / 48.0 / 20'000.0));
}

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

}  // namespace palpate::evaluated_bins_test
