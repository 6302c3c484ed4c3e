#include "familiarity_fit.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

TEST(Familiarity, RecoversALogisticModel) {
  Uniform random(1);
  std::vector<double> known;
  std::vector<double> unknown;
  for (int i = 0; i < 20000; ++i) {
    const double score = random(-0.6, -0.1);
    const double p = familiar_probability({.offset = 7.0, .slope = 20.0}, score);
    (random(0.0, 1.0) < p ? known : unknown).push_back(score);
  }
  const Familiarity fit = fit_familiarity({known, unknown});
  EXPECT_NEAR(fit.slope, 20.0, 0.8);  // within 2 standard errors
  EXPECT_NEAR(fit.offset / fit.slope, 0.35, 0.005);
}

TEST(Familiarity, StaysFiniteWhereScoresDoNotOverlap) {
  const std::vector<double> known{-0.10, -0.12, -0.11};
  const std::vector<double> unknown{-0.5, -0.4};
  const Familiarity fit = fit_familiarity({known, unknown});
  EXPECT_GT(fit.slope, 0.0);
  EXPECT_GT(familiar_probability(fit, -0.1), 0.7);
  EXPECT_LT(familiar_probability(fit, -0.1), 0.95);
  EXPECT_LT(familiar_probability(fit, -0.5), 0.35);
  EXPECT_GT(familiar_probability(fit, -0.5), 0.05);
}

TEST(Familiarity, SaysNothingWhereScoresDoNot) {
  const std::vector<double> same{-0.3, -0.3};
  EXPECT_EQ(fit_familiarity({same, same}).slope, 0.0);
  EXPECT_EQ(fit_familiarity({same, same}).offset, 0.0);
  const std::vector<double> low{-0.9, -0.8};
  EXPECT_EQ(fit_familiarity({low, same}).slope, 0.0) << "unknown presses score higher";
}

TEST(Familiarity, NeedsBothKinds) {
  const std::vector<double> scores{-0.3};
  EXPECT_THROW(fit_familiarity({scores, {}}), Error);
  EXPECT_THROW(fit_familiarity({{}, scores}), Error);
  const std::vector<double> infinite{-INFINITY};
  EXPECT_THROW(fit_familiarity({scores, infinite}), Error);
  EXPECT_THROW(area_under_curve({scores, {}}), Error);
}

TEST(AreaUnderCurve, CountsPairs) {
  const std::vector<double> known{1.0, 3.0};
  const std::vector<double> unknown{0.0, 1.0, 2.0};
  // Right: (1, 0), (3, 0), (3, 1), (3, 2); a tie: (1, 1).
  EXPECT_DOUBLE_EQ(area_under_curve({known, unknown}), 4.5 / 6.0);
}

}  // namespace
}  // namespace palpate
