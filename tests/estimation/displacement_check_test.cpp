#include "estimation/displacement_check.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "palpate/error.hpp"

namespace palpate::displacement_check_test {

constexpr PoseLattice region{
    .x_mm = {-10.0, 10.0, 5}, .y_mm = {-4.0, 4.0, 5}, .theta_rad = {0.0, 1.0, 5}};

/// What is said of these standard deviations; "" where they are taken.
std::string refusal(const DisplacementSd& sd, const PoseLattice& lattice = region) {
  try {
    validate_displacement(sd, lattice, "touch_sd");
    return "";
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::input);
    return error.what();
  }
}

TEST(DisplacementCheck, TakesWhatTheRegionHolds) {
  for (const DisplacementSd& sd :
       {DisplacementSd{}, DisplacementSd{.mm = 8.0}, DisplacementSd{.rad = 1.0},
        DisplacementSd{.mm = 1e-300, .rad = 0.05}}) {
    EXPECT_EQ(refusal(sd), "");
  }
}

TEST(DisplacementCheck, NamesWhatCannotBeMeant) {
  for (const double wrong : {-1.0, std::nan(""), std::numeric_limits<double>::infinity(), 8.1}) {
    EXPECT_TRUE(refusal({.mm = wrong}).starts_with("touch_sd mm = ")) << wrong;
    EXPECT_TRUE(refusal({.rad = wrong}).starts_with("touch_sd rad = ")) << wrong;
  }
  EXPECT_NE(refusal({.mm = 8.1}).find("wider than the region, 8 mm"), std::string::npos);
}

TEST(DisplacementCheck, LeavesAnAxisOfOneBinAlone) {
  PoseLattice lattice = region;
  lattice.y_mm.count = 1;
  lattice.theta_rad.count = 1;
  EXPECT_EQ(refusal({.mm = 20.0, .rad = 100.0}, lattice), "");
  EXPECT_NE(refusal({.mm = 20.1}, lattice), "");
  lattice.x_mm.count = 1;
  EXPECT_EQ(refusal({.mm = 1e6}, lattice), "");
}

TEST(UnresolvedDisplacement, IsBelowHalfAStep) {
  const auto said = [](const DisplacementSd& sd, const PoseLattice& lattice = region) {
    return unresolved_by_steps(sd, lattice, "touch-sd").value_or("");
  };
  // Steps of 4 mm, 1.6 mm and 0.2 rad.
  EXPECT_EQ(said({.mm = 2.0, .rad = 0.1}), "");
  EXPECT_EQ(said({}), "") << "nothing is blurred";
  EXPECT_NE(said({.mm = 1.9}).find("touch-sd of 1.9 mm: its step of x is 4 mm"), std::string::npos)
      << said({.mm = 1.9});
  EXPECT_NE(said({.rad = 0.09}).find("5.16 degrees: its step of theta is 11.5 degrees"),
            std::string::npos)
      << said({.rad = 0.09});
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
  EXPECT_NE(said(141.0, {.mm = 1.0, .rad = 0.1}).find("move the pivot near the touches"),
            std::string::npos);
  EXPECT_EQ(said(141.0, {.mm = 5.0, .rad = 0.1}), "") << "10 mm";
  EXPECT_EQ(said(1000.0, {.mm = 1.0}), "") << "no angle is blurred";
}

}  // namespace palpate::displacement_check_test
