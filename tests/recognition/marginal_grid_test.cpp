#include "recognition/filter.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::marginal_grid_test {

PoseLattice lattice_of(int nx, int ny, int ntheta) {
  return {{-10.0, 10.0, nx}, {-20.0, 25.0, ny}, {0.0, 6.283185307179586, ntheta}, {3.0, 4.0}};
}

TEST(MarginalGrid, IsTheLatticeWhereAPictureShowsItsBins) {
  for (const PoseLattice& lattice : {lattice_of(1, 25, 16), lattice_of(400, 399, 360)}) {
    const PoseLattice grid = marginal_grid(lattice);
    EXPECT_EQ(grid.x_mm.count, lattice.x_mm.count);
    EXPECT_EQ(grid.y_mm.count, lattice.y_mm.count);
    EXPECT_EQ(grid.theta_rad.count, lattice.theta_rad.count);
    EXPECT_EQ(grid.x_mm.upper, lattice.x_mm.upper);
    EXPECT_EQ(grid.y_mm.upper, lattice.y_mm.upper);
  }
}

TEST(MarginalGrid, HoldsWholeBinsAndTheRegion) {
  for (const int count : {401, 799, 800, 801, 1000, 40'009, 2'000'000'000}) {
    const PoseLattice lattice = lattice_of(count, 17, 100'000);
    const PoseLattice grid = marginal_grid(lattice);
    EXPECT_LE(grid.x_mm.count, 400);
    EXPECT_GE(grid.x_mm.count, 200);
    const double width = grid.x_mm.step() / lattice.x_mm.step();
    EXPECT_NEAR(width, std::round(width), 1e-9 * width) << count << ": stripes";
    EXPECT_EQ(grid.x_mm.lower, lattice.x_mm.lower);
    EXPECT_GE(grid.x_mm.upper, lattice.x_mm.upper);
    EXPECT_LT(grid.x_mm.upper, lattice.x_mm.upper + grid.x_mm.step());
    EXPECT_EQ(grid.y_mm.count, 17);
    EXPECT_EQ(grid.theta_rad.count, 360);
    EXPECT_TRUE(grid.full_circle());
    EXPECT_EQ(grid.pivot_mm, lattice.pivot_mm);
  }
}

TEST(MarginalGrid, OfTheLargestRegionIsSound) {
  PoseLattice lattice = lattice_of(1001, 1001, 1);
  lattice.x_mm = {-1e9, 1e9, 1001};
  EXPECT_NO_THROW(marginal_grid(lattice).validate());
}

}  // namespace palpate::marginal_grid_test
