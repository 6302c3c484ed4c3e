// Evaluated bins, and more of them than are kept: a posterior searches again for what needs them
// all.

#include "estimation/bounded/evaluated_bins.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bins_by_definition.hpp"
#include "bounded_set_up.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate::evaluated_bins_test {

/// Objects, thetas and bins of the boxes, and their values.
std::vector<std::pair<std::vector<std::int64_t>, std::vector<double>>> visited(
    const EvaluatedBins& bins) {
  std::vector<std::pair<std::vector<std::int64_t>, std::vector<double>>> kept;
  bins.visit([&](const BinBox& box, std::span<const double> values) {
    kept.push_back({{box.object, box.theta, box.bins()}, {values.begin(), values.end()}});
  });
  return kept;
}

TEST(EvaluatedBins, AreVisitedInTheOrderInWhichTheyCame) {
  EvaluatedBins bins;
  EXPECT_TRUE(visited(bins).empty());
  auto added = visited(bins);
  for (int i = 0; i < 50; ++i) {
    const BinBox box{.object = i, .theta = 2 * i, .y_count = i % 5 + 1, .x_count = 3};
    // One number stands for all bins of some boxes.
    std::vector<double> values(i % 3 == 0 ? 1 : static_cast<std::size_t>(box.bins()));
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = -i - 0.01 * static_cast<double>(k);
    }
    bins.add(box, values);
    added.push_back({{box.object, box.theta, box.bins()}, values});
  }
  EXPECT_TRUE(bins.complete());
  EXPECT_EQ(visited(bins), added);
  bins.clear();
  EXPECT_TRUE(visited(bins).empty());
  EXPECT_TRUE(bins.complete());
}

TEST(EvaluatedBins, AreGivenUpBeyondTheirMemory) {
  EvaluatedBins bins;
  const std::vector<double> values(1'000'000, -1.0);
  const BinBox box{.y_count = 1000, .x_count = 1000};
  // 80 MiB hold ten times 8 MB.
  for (int i = 0; i < 10; ++i) {
    bins.add(box, values);
    ASSERT_TRUE(bins.complete()) << i;
    ASSERT_LE(bins.bytes(), std::uint64_t{160} << 20);
  }
  bins.add(box, values);
  EXPECT_FALSE(bins.complete());
  EXPECT_EQ(bins.bytes(), 0U);
  bins.add({.y_count = 1, .x_count = 1}, std::span(values).first(1));
  EXPECT_FALSE(bins.complete()) << "some are missing, however few came last";
  EXPECT_TRUE(visited(bins).empty());
  bins.clear();
  EXPECT_TRUE(bins.complete());
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
  std::vector<double> xy(plane.size());
  std::vector<double> theta(48);
  for (std::size_t t = 0; t < theta.size(); ++t) {
    const BinBox box = whole_plane(options.lattice, static_cast<int>(t));
    likelihood.evaluate(std::span(&box, 1), elements, plane);
    for (std::size_t i = 0; i < plane.size(); ++i) {
      const double value = std::exp(plane[i]);
      xy[i] += value;
      theta[t] += value;
    }
  }
  const double total = sum(theta);
  for (double& value : xy) {
    value /= total;
  }
  for (double& value : theta) {
    value /= total;
  }
  const Marginals marginals = posterior.marginals(0);
  EXPECT_LE(largest_difference(marginals.xy, xy), options.tolerance);
  EXPECT_LE(largest_difference(marginals.theta, theta), options.tolerance);

  std::vector<double> drawn(theta.size());
  for (const PoseSample& sample : posterior.sample(20'000, 702)) {
    const std::int64_t bin = options.lattice.bin_of(sample.T_object_robot);
    drawn[static_cast<std::size_t>(bin / options.lattice.plane())] += 1.0 / 20'000.0;
  }
  EXPECT_NEAR(sum(drawn), 1.0, 1e-9);
  // Five standard errors of the share of a theta, some 1/48.
  EXPECT_LE(largest_difference(drawn, theta), 5.0 * std::sqrt(1.0 / 48.0 / 20'000.0));
}

}  // namespace palpate::evaluated_bins_test
