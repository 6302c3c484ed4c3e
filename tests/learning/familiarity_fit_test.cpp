#include "learning/familiarity_fit.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "synthetic.hpp"

namespace palpate::familiarity_fit_test {

TEST(Familiarity, RecoversALogisticModel) {
  Uniform random(1);
  std::vector<FamiliarityScore> known;
  std::vector<FamiliarityScore> unknown;
  const Familiarity truth{.offset = 5.0, .explained_slope = 20.0, .lead_slope = 1.0};
  for (int i = 0; i < 20000; ++i) {
    const FamiliarityScore score{.explained = random(-0.6, -0.1), .lead = random(0.0, 4.0)};
    (random(0.0, 1.0) < truth.probability(score) ? known : unknown).push_back(score);
  }
  const Familiarity fit = fit_familiarity({known, unknown});
  EXPECT_NEAR(fit.explained_slope, 20.0, 0.8);  // within about 2 standard errors
  EXPECT_NEAR(fit.lead_slope, 1.0, 0.06);
  EXPECT_NEAR(fit.offset, 5.0, 0.35);
}

TEST(Familiarity, StaysFiniteWhereScoresDoNotOverlap) {
  const std::vector<FamiliarityScore> known{{-0.10, 1.0}, {-0.12, 1.0}, {-0.11, 1.0}};
  const std::vector<FamiliarityScore> unknown{{-0.5, 1.0}, {-0.4, 1.0}};
  const Familiarity fit = fit_familiarity({known, unknown});
  EXPECT_GT(fit.explained_slope, 0.0);
  EXPECT_EQ(fit.lead_slope, 0.0) << "all leads are the same";
  EXPECT_GT(fit.probability(known.front()), 0.7);
  EXPECT_LT(fit.probability(known.front()), 0.95);
  EXPECT_LT(fit.probability(unknown.front()), 0.35);
  EXPECT_GT(fit.probability(unknown.front()), 0.05);
}

TEST(Familiarity, TakesNoScoreThatSpeaksForTheUnknown) {
  const std::vector<FamiliarityScore> same{{-0.3, 2.0}, {-0.3, 2.0}};
  const Familiarity nothing = fit_familiarity({same, same});
  EXPECT_EQ(nothing.explained_slope, 0.0);
  EXPECT_EQ(nothing.lead_slope, 0.0);
  EXPECT_NEAR(nothing.offset, 0.0, 1e-12);
  const std::vector<FamiliarityScore> low{{-0.9, 3.0}, {-0.8, 3.1}};
  const Familiarity lead_only = fit_familiarity({low, same});
  EXPECT_EQ(lead_only.explained_slope, 0.0);
  EXPECT_GT(lead_only.lead_slope, 0.0);
}

TEST(Familiarity, NeedsBothKinds) {
  const std::vector<FamiliarityScore> scores{{-0.3, 1.0}};
  EXPECT_THROW(fit_familiarity({.known = scores, .unknown = {}}), Error);
  EXPECT_THROW(fit_familiarity({.known = {}, .unknown = scores}), Error);
  const std::vector<FamiliarityScore> infinite{{-INFINITY, 1.0}};
  EXPECT_THROW(fit_familiarity({scores, infinite}), Error);
  EXPECT_THROW(area_under_curve({scores, {}}, {}), Error);
}

TEST(AreaUnderCurve, CountsPairs) {
  const std::vector<FamiliarityScore> known{{1.0, 0.0}, {3.0, 0.0}};
  const std::vector<FamiliarityScore> unknown{{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}};
  // Right: (1, 0), (3, 0), (3, 1), (3, 2); a tie: (1, 1).
  EXPECT_DOUBLE_EQ(area_under_curve({known, unknown}, {.explained_slope = 1.0}), 4.5 / 6.0);
}

TEST(AreaUnderCurve, OfAFoldIsByTheRegressionOfTheOthers) {
  const std::vector<FamiliarityScore> high{{-0.1, 0.0}, {-0.2, 0.0}};
  const std::vector<FamiliarityScore> low{{-0.8, 0.0}, {-0.9, 0.0}};
  const std::vector<FamiliarityScores> folds{{high, low}, {high, low}, {low, high}};
  // Two of three folds say that known presses score higher; the third's own would not.
  EXPECT_EQ(area_under_curve(folds, 2), 0.0);
  EXPECT_EQ(area_under_curve(std::vector<FamiliarityScores>{{high, low}, {low, low}}, 0), 0.5)
      << "the other says nothing";
  EXPECT_FALSE(area_under_curve(std::vector<FamiliarityScores>{{high, low}}, 0).has_value());
  EXPECT_FALSE(area_under_curve(std::vector<FamiliarityScores>{{high, {}}, {high, low}}, 0));
}

}  // namespace palpate::familiarity_fit_test
