#include "estimation/lattice/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "bound_cases.hpp"

namespace palpate::thinned_lattice_test {

constexpr double rounding_mm = 1e-9;

TEST(ThinnedLattice, HasStepsOfATenthOfAMillimetreAtMost) {
  for (const int count : {100, 599, 601, 1000, 4000, 20'000}) {
    const PoseLattice fine{.x_mm = {-10.0, 10.0, count}, .y_mm = {3.0, 23.0, count}};
    const PoseLattice few = thinned(fine);
    for (const auto& [thin, all] : {std::pair(few.x_mm, fine.x_mm), {few.y_mm, fine.y_mm}}) {
      SCOPED_TRACE(count);
      EXPECT_LE(thin.step(), std::max(0.1, all.step()) + rounding_mm);
      EXPECT_GE(thin.step(), std::min(0.05, all.step())) << "as wide as may be";
      EXPECT_LE(thin.upper, all.upper + rounding_mm);
      EXPECT_GT(thin.upper, all.upper - 0.1);
    }
    EXPECT_EQ(few.theta_rad.count, fine.theta_rad.count);
  }
  const PoseLattice coarse{.x_mm = {-10.0, 10.0, 599}};  // three steps are more than 0.1 mm
  EXPECT_EQ(thinned(coarse).x_mm.count, 599);
}

TEST(ThinnedLattice, ItsCentresAreCentresOfTheLattice) {
  Uniform uniform(831);
  for (int trial = 0; trial < 300; ++trial) {
    const double lower = uniform(-20.0, 20.0);
    const double width = std::pow(10.0, uniform(-4.0, 1.5));
    const Axis all{lower, lower + width, static_cast<int>(uniform(1.0, 400.0))};
    const Axis thin = thinned({.x_mm = all}).x_mm;
    SCOPED_TRACE(testing::Message() << all.count << " bins of " << all.step() << " mm");
    EXPECT_GE(thin.count, std::min(all.count, 3)) << "narrow regions keep some";
    EXPECT_EQ(thin.lower, all.lower);
    EXPECT_LE(thin.upper, all.upper + rounding_mm);
    for (const int bin : {0, thin.count / 2, thin.count - 1}) {
      const double index = (thin.centre(bin) - all.lower) / all.step() - 0.5;
      EXPECT_NEAR(index, std::round(index), 1e-6);
      EXPECT_LT(std::round(index), all.count);
    }
  }
}

TEST(ThinnedLattice, RefinedPosesLieInTheRegion) {
  const Recording recording = touches_of_l(5, 832);
  Uniform uniform(833);
  const auto axis = [&](double middle, double widest) {
    const double width = widest * std::pow(10.0, uniform(-3.5, 0.0));
    const double lower = middle + uniform(-1.5, 0.5) * width;
    return Axis{lower, lower + width, static_cast<int>(uniform(1.0, 12.0))};
  };
  for (int trial = 0; trial < 8; ++trial) {
    SCOPED_TRACE(testing::Message() << "trial " << trial);
    const PoseLattice region{
        .x_mm = axis(1.3, 10.0),
        .y_mm = axis(-0.8, 10.0),
        .theta_rad = trial % 4 == 3 ? Axis{-1.0, -1.0 + two_pi, 2 * trial} : axis(0.7, 5.0)};
    BothFilters both({two_shapes()[0]}, {.lattice = region});
    for (const Touch& touch : all_touches(recording)) {
      both.update(touch);
    }
    for (const RefinedPose& refined : {both.bounded.refine(both.bounded.estimate().mode),
                                       both.dense.refine(both.dense.estimate().mode)}) {
      const auto& [place_mm, theta_rad] = refined.T_object_robot;
      for (const auto& [at, within] :
           {std::pair(place_mm.x, region.x_mm), std::pair(place_mm.y, region.y_mm),
            std::pair(theta_rad, region.theta_rad)}) {
        EXPECT_GE(at, within.lower - rounding_mm);
        EXPECT_LE(at, within.upper + rounding_mm);
      }
    }
  }
}

}  // namespace palpate::thinned_lattice_test
