#include "palpate/balanced_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/simulation.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

/// A letter as it is, on cells of 0.5 mm.
Hypothesis letter(const char* name) {
  const Shape shape = make_shape(name);
  OccupancyGrid map{.label = name, .origin_mm = {-16, -16}, .nx = 65, .ny = 65, .log_odds = {}};
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      map.log_odds.push_back(shape.contains(map.centre_mm(i, j)) ? 4.0F : -4.0F);
    }
  }
  return {map, 1.0};
}

const std::vector<Hypothesis>& letters() {
  static const std::vector<Hypothesis> five{letter("A"), letter("E"), letter("I"), letter("O"),
                                            letter("U")};
  return five;
}

TEST(BalancedLattice, OfThePapersLettersIsNearWhatAHandWouldChoose) {
  const BalancedLattice balanced = balanced_lattice({}, letters());
  EXPECT_EQ(balanced.lattice.x_mm.count, 67) << "20 mm in steps of 0.6 x 0.5 mm";
  EXPECT_EQ(balanced.lattice.y_mm.count, 67);
  // 0.3 mm where the lever is longest, 13.3 mm; the letters' mean would be content with 244.
  EXPECT_NEAR(balanced.lattice.theta_rad.count, 278, 5);
  EXPECT_FALSE(balanced.coarsened);
  EXPECT_DOUBLE_EQ(balanced.step_mm, 0.3);
}

TEST(BalancedLattice, TurnsAnObjectByAsMuchAsItShiftsIt) {
  const PoseLattice region;
  for (const Hypothesis& object : letters()) {
    const BalancedLattice balanced = balanced_lattice(region, std::span(&object, 1));
    // Mean squared displacement of the cells by one step of theta, the pivot anywhere.
    Uniform random(160);
    double squares = 0.0;
    int cells = 0;
    const double turn = balanced.lattice.theta_rad.step();
    for (int j = 0; j < object.map.ny; ++j) {
      for (int i = 0; i < object.map.nx; ++i) {
        if (object.map.at(i, j) > 0.0F) {
          const glm::dvec2 from_pivot =
              object.map.centre_mm(i, j) - glm::dvec2(random(-10, 10), random(-10, 10));
          const glm::dvec2 moved = rotate(turn, from_pivot) - from_pivot;
          squares += moved.x * moved.x + moved.y * moved.y;
          ++cells;
        }
      }
    }
    // Counts round up by at most one in some 200; the pivots are some hundreds of samples.
    EXPECT_NEAR(std::sqrt(squares / cells), balanced.step_mm, 0.05 * balanced.step_mm);
  }
}

TEST(BalancedLattice, TakesTheFinestMapAndTheLongestLever) {
  std::vector<Hypothesis> objects{letter("O")};
  const BalancedLattice one = balanced_lattice({}, objects);
  objects.push_back(letter("O"));
  objects[1].map.cell_mm = 0.25;
  objects[1].map.origin_mm /= 2.0;
  const BalancedLattice finer = balanced_lattice({}, objects);
  EXPECT_EQ(finer.lattice.x_mm.count, 134);
  EXPECT_NEAR(finer.lattice.theta_rad.count, 2 * one.lattice.theta_rad.count, 2);
  objects[1] = letter("O");
  objects[1].map.origin_mm.x += 30.0;
  EXPECT_GT(balanced_lattice({}, objects).lattice.theta_rad.count, 2 * one.lattice.theta_rad.count);
}

TEST(BalancedLattice, StopsAtWhatTheSensorShows) {
  const auto counts = [](double cell_mm, std::optional<double> spread_mm) {
    Hypothesis object = letter("O");
    object.map.origin_mm *= cell_mm / object.map.cell_mm;
    object.map.cell_mm = cell_mm;
    object.map.spread_mm = spread_mm;
    return balanced_lattice({}, std::span(&object, 1)).lattice.x_mm.count;
  };
  EXPECT_EQ(counts(0.25, {}), 134) << "not known";
  EXPECT_EQ(counts(0.25, 0.5), 67) << "20 mm in steps of 0.6 x 0.5 mm";
  EXPECT_EQ(counts(0.25, 0.1), 134) << "cells wider than the spread";
  EXPECT_EQ(counts(0.5, 0.5), 67);
  EXPECT_EQ(counts(1.0, 0.5), 34);
  std::vector<Hypothesis> objects{letter("O"), letter("O")};
  objects[0].map.spread_mm = 2.0;
  EXPECT_EQ(balanced_lattice({}, objects).lattice.x_mm.count, 67) << "the finest counts";
}

TEST(BalancedLattice, FollowsTheRegionAndCollapsesWhatIsFixed) {
  PoseLattice region;
  region.x_mm = {3.0, 3.0, 9};
  region.y_mm = {-1.0, 2.0, 9};
  region.theta_rad = {1.0, 1.0, 9};
  region.pivot_mm = {7.0, 8.0};
  const PoseLattice lattice = balanced_lattice(region, letters()).lattice;
  EXPECT_EQ(lattice.x_mm.count, 1);
  EXPECT_EQ(lattice.y_mm.count, 10);
  EXPECT_EQ(lattice.theta_rad.count, 1);
  EXPECT_EQ(lattice.x_mm.lower, 3.0);
  EXPECT_EQ(lattice.pivot_mm, region.pivot_mm);
  region.theta_rad = {0.0, two_pi / 4, 1};
  const int quarter = balanced_lattice(region, letters()).lattice.theta_rad.count;
  region.theta_rad = {0.0, two_pi, 1};
  EXPECT_NEAR(balanced_lattice(region, letters()).lattice.theta_rad.count, 4 * quarter, 4);
}

TEST(BalancedLattice, IsMadeCoarserAlikeToKeepToABound) {
  const PoseLattice free = balanced_lattice({}, letters()).lattice;
  for (const std::int64_t most : {1'000'000, 20'000, 100, 5}) {
    const BalancedLattice balanced = balanced_lattice({}, letters(), most);
    const PoseLattice& lattice = balanced.lattice;
    EXPECT_TRUE(balanced.coarsened);
    EXPECT_LE(5 * lattice.bins(), most);
    EXPECT_GT(balanced.step_mm, 0.3);
    if (most >= 1'000'000) {
      EXPECT_GT(5 * lattice.bins(), 9 * most / 10) << "not coarser than need be";
      EXPECT_NEAR(static_cast<double>(lattice.theta_rad.count) / lattice.x_mm.count,
                  static_cast<double>(free.theta_rad.count) / free.x_mm.count, 0.2);
    }
  }
  EXPECT_THROW(balanced_lattice({}, letters(), 4), Error) << "fewer bins than objects";
}

TEST(BalancedLattice, OfAnEndlessRegionIsBounded) {
  PoseLattice region;
  region.x_mm = {-farthest_mm, farthest_mm, 1};
  region.y_mm = {-farthest_mm, farthest_mm, 1};
  region.theta_rad = {-1e9, 1e9, 1};
  const BalancedLattice balanced = balanced_lattice(region, letters());
  EXPECT_TRUE(balanced.coarsened);
  EXPECT_LE(5 * balanced.lattice.bins(), most_balanced_bins);
  for (const Axis& x_mm : {Axis{1.0, -1.0, 1}, Axis{-1e200, 1e200, 1}}) {
    region.x_mm = x_mm;
    EXPECT_THROW(balanced_lattice(region, letters()), Error);
  }
  EXPECT_THROW(balanced_lattice({}, {}), Error);
}

TEST(BalancedLattice, FitsTheDevice) {
  Device device = Device::open();
  const std::int64_t most = most_bins_on(device, false);
  EXPECT_LE(most, most_balanced_bins);
  EXPECT_LE(8 * most, static_cast<std::int64_t>(device.memory_bytes() / 2));
  EXPECT_EQ(most_bins_on(device, true),
            std::min(static_cast<std::int64_t>(device.memory_bytes() / 32), most_balanced_bins));
  const PoseLattice region{{-0.9, 0.9, 1}, {-0.9, 0.9, 1}, {0.0, 0.3, 1}, {}};
  const PoseLattice lattice = balanced_lattice(region, letters(), most).lattice;
  const PoseHistogram histogram(device, letters(), {.lattice = lattice});
  EXPECT_EQ(histogram.lattice().bins(), lattice.bins());
}

}  // namespace
}  // namespace palpate
