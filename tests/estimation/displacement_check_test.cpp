#include "displacement_check.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "palpate/error.hpp"

namespace palpate {
namespace {

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

}  // namespace
}  // namespace palpate
