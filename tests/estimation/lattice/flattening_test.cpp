#include "estimation/lattice/refinement.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace palpate::flattening_test {

constexpr double least = 8.0;

/// Bins 0.1 mm apart within 2 mm, with logs that fall by `nats` over the first millimetre from the
/// middle and with its square.
std::vector<DisplacedBin> parabola(double nats) {
  std::vector<DisplacedBin> bins;
  for (int i = -20; i <= 20; ++i) {
    const double mm = 0.1 * i;
    bins.push_back({{mm, 0.0, 0.0}, -1e6 - nats * mm * mm});
  }
  return bins;
}

TEST(FlatteningRoot, IsTheLeastWhereThatSpreadsTheBeliefEnough) {
  EXPECT_EQ(flattening_root(parabola(0.0), least), least);
  EXPECT_EQ(flattening_root(parabola(4.0), least), least);
}

TEST(FlatteningRoot, SpreadsASharpBeliefByAThirdOfItsWindow) {
  // A normal distribution: its variance is root / (2 nats), a third of the window's own is 0.394
  // mm.
  const double window_mm = 0.1 * std::sqrt((41.0 * 41.0 - 1.0) / 12.0);
  for (const double nats : {100.0, 1e3, 1e4, 1e9}) {
    const double root = flattening_root(parabola(nats), least);
    EXPECT_NEAR(std::sqrt(root / (2.0 * nats)), window_mm / 3.0, 0.03) << nats;
  }
}

TEST(FlatteningRoot, FollowsTheBeliefWithoutSteps) {
  double before = flattening_root(parabola(100.0), least);
  for (double nats = 101.0; nats < 400.0; nats += 1.0) {
    const double root = flattening_root(parabola(nats), least);
    EXPECT_GT(root, before);
    EXPECT_LT(root, 1.03 * before);
    before = root;
  }
}

TEST(FlatteningRoot, OfOneBinOrOneThatHasItAllIsFinite) {
  EXPECT_EQ(flattening_root(std::vector<DisplacedBin>{{{0.0, 0.0, 0.0}, -5.0}}, least), least);
  const std::vector<DisplacedBin> certain{{{0.0, 0.0, 0.0}, 0.0}, {{1.0, 0.0, 0.0}, -1e30}};
  EXPECT_TRUE(std::isfinite(flattening_root(certain, least)));
}

}  // namespace palpate::flattening_test
