#include "figures/placed_belief.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

namespace palpate::placed_belief_test {

const PoseLattice lattice{
    {-10.0, 10.0, 40}, {-8.0, 8.0, 32}, {0.0, 2.0 * std::numbers::pi, 72}, {150.0, -40.0}};

/// Where a cell of the belief lies.
glm::dvec2 centre(const PlacedBelief& belief, std::size_t cell) {
  const auto across = static_cast<std::size_t>(belief.cells);
  return belief.lower_mm +
         belief.cell_mm * (glm::dvec2(cell % across, cell / across) + glm::dvec2(0.5));
}

TEST(PlacedBelief, ABinLiesWhereItsPoseHasTheObject) {
  for (const Pose& T_object_robot :
       {lattice.T_object_robot(0.25, 0.25, 0.04), lattice.T_object_robot(-7.25, 5.25, 3.9)}) {
    const BinShare bin{lattice.bin_of(T_object_robot), 1.0};
    const PlacedBelief belief = placed_belief(lattice, std::span(&bin, 1));
    const Pose expected = inverse(lattice.T_object_robot(bin.bin));
    glm::dvec2 mean{0.0};
    for (std::size_t cell = 0; cell < belief.xy.size(); ++cell) {
      mean += belief.xy[cell] * centre(belief, cell);
    }
    // The 27 parts of a bin lie on an arc of 5 degrees, and in cells of 0.5 mm.
    EXPECT_NEAR(mean.x, expected.translation_mm.x, 0.2);
    EXPECT_NEAR(mean.y, expected.translation_mm.y, 0.2);
    EXPECT_NEAR(std::accumulate(belief.xy.begin(), belief.xy.end(), 0.0), 1.0, 1e-12);
    const auto turn = std::ranges::max(belief.theta, {}, &PlacedBelief::ThetaShare::probability);
    EXPECT_NEAR(std::remainder(turn.theta_rad - expected.theta_rad, 2.0 * std::numbers::pi), 0.0,
                1e-12);
    EXPECT_TRUE(std::ranges::is_sorted(belief.theta, {}, &PlacedBelief::ThetaShare::theta_rad));
  }
}

TEST(PlacedBelief, TheWindowHoldsWhatMattersAndNoMore) {
  const std::int64_t near = lattice.bin_of(lattice.T_object_robot(0.25, 0.25, 0.04));
  const std::int64_t far = lattice.bin_of(lattice.T_object_robot(-9.0, -7.0, 0.04));
  const std::vector<BinShare> both{{near, 0.9}, {far, 0.1}};
  const PlacedBelief wide = placed_belief(lattice, both);
  EXPECT_GE(wide.cells * wide.cell_mm, 9.0);
  const std::vector<BinShare> hardly{{near, 0.99999}, {far, 0.00001}};
  const PlacedBelief narrow = placed_belief(lattice, hardly);
  EXPECT_LE(narrow.cells * narrow.cell_mm, 8.0);
  EXPECT_NEAR(narrow.cell_mm, 0.5, 1e-12) << "no finer than the lattice";
}

TEST(PlacedBelief, ManyBinsAreSeenInFewCells) {
  PoseLattice large = lattice;
  large.x_mm = {-500.0, 500.0, 20000};
  large.y_mm = {-500.0, 500.0, 20000};
  const std::vector<BinShare> corners{{0, 0.5}, {large.plane() - 1, 0.5}};
  const PlacedBelief belief = placed_belief(large, corners);
  EXPECT_LE(belief.cells, 160);
  EXPECT_NEAR(std::accumulate(belief.xy.begin(), belief.xy.end(), 0.0), 1.0, 1e-12);
}

}  // namespace palpate::placed_belief_test
