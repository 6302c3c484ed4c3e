#include "estimation/particles/particle_draws.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::likelihood_averages_test {

TEST(LikelihoodAverages, InjectWhereTheFastFallsBelowTheSlow) {
  LikelihoodAverages averages(0.1, 0.5);
  EXPECT_EQ(averages.injected(), 0.0) << "nothing is known yet";
  // exp(-1) and exp(-2) per element, from touches of 36 and 10: the number does not matter.
  averages.add(-36.0, 36);
  EXPECT_EQ(averages.injected(), 0.0) << "both start at the first touch";
  averages.add(-20.0, 10);
  const double a = std::exp(-1.0);
  const double b = std::exp(-2.0);
  EXPECT_NEAR(averages.injected(), 1.0 - (a + 0.5 * (b - a)) / (a + 0.1 * (b - a)), 1e-15)
      << "rounding";
  averages.add(-3.0, 30);
  EXPECT_EQ(averages.injected(), 0.0) << "the fast one is above the slow one again";
}

TEST(LikelihoodAverages, StandAThousandElementsAndATouchOfNoLikelihood) {
  LikelihoodAverages averages(0.1, 0.5);
  averages.add(-2000.0, 1000);  // exp(-2000) is 0 in float64
  averages.add(-4000.0, 1000);
  EXPECT_GT(averages.injected(), 0.1);
  EXPECT_LT(averages.injected(), 1.0);
  LikelihoodAverages none(0.1, 0.5);
  none.add(-1e6, 1);
  EXPECT_EQ(none.injected(), 0.0) << "0 / 0";
}

}  // namespace palpate::likelihood_averages_test
