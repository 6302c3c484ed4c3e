#include "estimation/displacement_weights.hpp"

#include <gtest/gtest.h>

#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::displacement_check_test {

constexpr PoseLattice region{
    .x_mm = {-10.0, 10.0, 5}, .y_mm = {-4.0, 4.0, 5}, .theta_rad = {0.0, 1.0, 5}};

void check(const DisplacementSd& sd, const PoseLattice& lattice = region) {
  validate_displacement(sd, lattice, "touch_sd");
}

TEST(DisplacementCheck, TakesWhatTheRegionHolds) {
  for (const DisplacementSd& sd :
       {DisplacementSd{}, DisplacementSd{.mm = 8.0}, DisplacementSd{.rad = 1.0},
        DisplacementSd{.mm = 1e-300, .rad = 0.05}}) {
    EXPECT_NO_THROW(check(sd));
  }
}

TEST(DisplacementCheck, NamesWhatCannotBeMeant) {
  for (const double wrong : {-1.0, nan, infinity, 8.1}) {
    EXPECT_TRUE(input_error([&] { check({.mm = wrong}); }).starts_with("touch_sd mm = ")) << wrong;
    EXPECT_TRUE(input_error([&] { check({.rad = wrong}); }).starts_with("touch_sd rad = "));
  }
  expect_named(input_error([] { check({.mm = 8.1}); }), {"wider than the region, 8 mm"});
}

TEST(DisplacementCheck, LeavesAnAxisOfOneBinAlone) {
  PoseLattice lattice = region;
  lattice.y_mm.count = 1;
  lattice.theta_rad.count = 1;
  EXPECT_NO_THROW(check({.mm = 20.0, .rad = 100.0}, lattice));
  EXPECT_THROW(check({.mm = 20.1}, lattice), Error);
  lattice.x_mm.count = 1;
  EXPECT_NO_THROW(check({.mm = 1e6}, lattice));
}

TEST(UnresolvedDisplacement, IsBelowHalfAStep) {
  const auto said = [](const DisplacementSd& sd, const PoseLattice& lattice = region) {
    return unresolved_by_steps(sd, lattice, "touch-sd").value_or("");
  };
  // Steps of 4 mm, 1.6 mm and 0.2 rad.
  EXPECT_EQ(said({.mm = 2.0, .rad = 0.1}), "");
  EXPECT_EQ(said({}), "") << "nothing is blurred";
  expect_named(said({.mm = 1.9}), {"touch-sd of 1.9 mm: its step of x is 4 mm"});
  expect_named(said({.rad = 0.09}), {"5.16 degrees: its step of theta is 11.5 degrees"});
  PoseLattice fixed = region;
  fixed.x_mm.count = 1;
  fixed.theta_rad.count = 1;
  EXPECT_EQ(said({.mm = 1.0, .rad = 0.01}, fixed), "") << "axes of one bin are not blurred";
}

TEST(UnresolvedDisplacement, LiesFarFromThePivot) {
  PoseLattice lattice = region;
  lattice.pivot_mm = {100.0, 0.0};
  const auto said = [&](double x_mm, const DisplacementSd& sd) {
    return unresolved_at({{x_mm, 0.0}, 0.0}, sd, lattice, "touch-sd").value_or("");
  };
  // A step of 0.2 rad moves a sensor at r mm by 0.2 r mm; twice the step of x is 8 mm.
  EXPECT_EQ(said(139.0, {.mm = 1.0, .rad = 0.1}), "");
  expect_named(said(141.0, {.mm = 1.0, .rad = 0.1}), {"move the pivot near the touches"});
  EXPECT_EQ(said(141.0, {.mm = 5.0, .rad = 0.1}), "") << "10 mm";
  EXPECT_EQ(said(1000.0, {.mm = 1.0}), "") << "no angle is blurred";
}

}  // namespace palpate::displacement_check_test
