#include "palpate/balanced_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "palpate/pose_histogram.hpp"
#include "palpate/simulation.hpp"
#include "palpate/touch.hpp"
#include "support/errors.hpp"
#include "support/synthetic.hpp"
#include "support/touched_shape.hpp"

namespace palpate::balanced_lattice_test {

/// A letter as it is, on cells of 0.5 mm.
Hypothesis letter(const char* name) {
  const Shape shape = make_shape(name);
  return {map_of([&](const glm::dvec2& p_mm) { return shape.contains(p_mm); }, name), 1.0};
}

const std::vector<Hypothesis>& letters() {
  static const std::vector<Hypothesis> five{letter("A"), letter("E"), letter("I"), letter("O"),
                                            letter("U")};
  return five;
}

/// In steps of 0.6 of the finest detail.
BalancedLattice fine_lattice(const PoseLattice& region, std::span<const Hypothesis> hypotheses,
                             std::int64_t most_bins = most_balanced_bins) {
  return balanced_lattice(region, hypotheses, most_bins, BinWidth::fine);
}

TEST(BalancedLattice, TurnsAnObjectByAsMuchAsItShiftsIt) {
  const PoseLattice region;
  for (const Hypothesis& object : letters()) {
    const BalancedLattice balanced = fine_lattice(region, std::span(&object, 1));
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
  const BalancedLattice one = fine_lattice({}, objects);
  objects.push_back(letter("O"));
  objects[1].map.cell_mm = 0.25;
  objects[1].map.origin_mm /= 2.0;
  const BalancedLattice finer = fine_lattice({}, objects);
  EXPECT_EQ(finer.lattice.x_mm.count, 134);
  EXPECT_NEAR(finer.lattice.theta_rad.count, 2 * one.lattice.theta_rad.count, 2);
  objects[1] = letter("O");
  objects[1].map.origin_mm.x += 30.0;
  EXPECT_GT(fine_lattice({}, objects).lattice.theta_rad.count, 2 * one.lattice.theta_rad.count);
}

TEST(BalancedLattice, StepsAreOfTheCellOrOfWhatTheSensorShows) {
  struct Row {
    double cell_mm;
    std::optional<double> spread_mm;
    double fine_mm;       ///< 0.6 times the larger
    double automatic_mm;  ///< 0.6 times the larger of the cell and twice the spread
  };
  // A map that does not know the spread has as much as its cell.
  for (const auto& [cell_mm, spread_mm, fine_mm, automatic_mm] :
       {Row{0.25, {}, 0.15, 0.3}, Row{0.25, 0.5, 0.3, 0.6}, Row{0.25, 0.1, 0.15, 0.15},
        Row{0.5, 0.5, 0.3, 0.6}, Row{0.5, {}, 0.3, 0.6}, Row{1.0, 0.5, 0.6, 0.6},
        Row{2.0, 0.5, 1.2, 1.2}}) {
    SCOPED_TRACE(testing::Message() << cell_mm << ", " << spread_mm.value_or(0.0));
    Hypothesis object = letter("O");
    object.map.cell_mm = cell_mm;
    object.map.spread_mm = spread_mm;
    const BalancedLattice fine = fine_lattice({}, std::span(&object, 1));
    EXPECT_DOUBLE_EQ(fine.step_mm, fine_mm);
    EXPECT_FALSE(fine.coarsened);
    EXPECT_EQ(fine.lattice.x_mm.count, std::ceil(20.0 / fine_mm - 1e-9));
    EXPECT_EQ(fine.lattice.y_mm.count, fine.lattice.x_mm.count);
    EXPECT_DOUBLE_EQ(balanced_lattice({}, std::span(&object, 1)).step_mm, automatic_mm);
  }
  std::vector<Hypothesis> objects{letter("O"), letter("O")};
  objects[0].map.spread_mm = 2.0;
  EXPECT_EQ(fine_lattice({}, objects).lattice.x_mm.count, 67) << "the finest counts";
  const PoseLattice fine = fine_lattice({}, letters()).lattice;
  // 0.3 mm where the lever is longest, 13.3 mm; the letters' mean would be content with 244.
  EXPECT_NEAR(fine.theta_rad.count, 278, 5);
  const PoseLattice lattice = balanced_lattice({}, letters()).lattice;
  EXPECT_EQ(lattice.x_mm.count, 34) << "20 mm in steps of 0.6 mm";
  EXPECT_NEAR(lattice.theta_rad.count, fine.theta_rad.count / 2.0, 1.0);
}

TEST(BalancedLattice, FollowsUncertainTouchesUpToTwoAndAHalfSteps) {
  const auto lattice = [](const DisplacementSd& touch_sd, const DisplacementSd& slip_sd,
                          BinWidth width = BinWidth::automatic) {
    return balanced_lattice({}, letters(), most_balanced_bins, width, touch_sd, slip_sd);
  };
  const BalancedLattice exact = lattice({}, {});
  const double step_rad = exact.lattice.theta_rad.step();
  struct Row {
    DisplacementSd touch_sd;
    DisplacementSd slip_sd;
    double step_mm;
    double steps_of_theta;
  };
  for (const auto& [touch_sd, slip_sd, step_mm, steps_of_theta] :
       {Row{{}, {}, 0.6, 1.0}, Row{{.mm = 1.0}, {}, 0.6, 1.0}, Row{{.mm = 1.5}, {}, 0.75, 1.0},
        Row{{.mm = 2.0}, {}, 1.0, 1.0}, Row{{.mm = 3.0}, {}, 1.5, 1.0},
        Row{{.mm = 9.0}, {}, 1.5, 1.0},              // two and a half steps
        Row{{.rad = 3.0 * step_rad}, {}, 0.6, 1.5},  // half of it
        Row{{}, {.mm = 0.8}, 1.0, 1.0},
        Row{{}, {.rad = 2.0 * step_rad}, 0.6, 2.5},  // five quarters
        Row{{.mm = 2.0}, {.mm = 0.6}, 1.0, 1.0}}) {  // the wider of both
    SCOPED_TRACE(testing::Message() << touch_sd.mm << ", " << slip_sd.mm << " mm");
    const BalancedLattice with = lattice(touch_sd, slip_sd);
    EXPECT_DOUBLE_EQ(with.step_mm, step_mm);
    EXPECT_EQ(with.lattice.x_mm.count, std::ceil(20.0 / step_mm - 1e-9));
    EXPECT_NEAR(with.lattice.theta_rad.step(), steps_of_theta * step_rad,
                steps_of_theta > 1.0 ? 0.04 * step_rad : 0.0);
    EXPECT_FALSE(with.coarsened);
  }
  const BalancedLattice fine = lattice({.mm = 9.0, .rad = 1.0}, {}, BinWidth::fine);
  EXPECT_EQ(fine.lattice.bins(), fine_lattice({}, letters()).lattice.bins()) << "for the mode";
  expect_named(input_error([&] { lattice({.mm = std::nan("")}, {}); }), {"touch_sd mm = nan"});
  expect_named(input_error([&] { lattice({}, {.rad = -1.0}); }), {"slip_sd rad = -1"});
}

TEST(BalancedLattice, FollowsTheRegionAndCollapsesWhatIsFixed) {
  PoseLattice region;
  region.x_mm = {3.0, 3.0, 9};
  region.y_mm = {-1.0, 2.0, 9};
  region.theta_rad = {1.0, 1.0, 9};
  region.pivot_mm = {7.0, 8.0};
  const PoseLattice lattice = fine_lattice(region, letters()).lattice;
  EXPECT_EQ(lattice.x_mm.count, 1);
  EXPECT_EQ(lattice.y_mm.count, 10);
  EXPECT_EQ(lattice.theta_rad.count, 1);
  EXPECT_EQ(lattice.x_mm.lower, 3.0);
  EXPECT_EQ(lattice.pivot_mm, region.pivot_mm);
  region.theta_rad = {0.0, two_pi / 4, 1};
  const int quarter = fine_lattice(region, letters()).lattice.theta_rad.count;
  region.theta_rad = {0.0, two_pi, 1};
  EXPECT_NEAR(fine_lattice(region, letters()).lattice.theta_rad.count, 4 * quarter, 4);
}

TEST(BalancedLattice, IsMadeCoarserAlikeToKeepToABound) {
  const PoseLattice free = fine_lattice({}, letters()).lattice;
  for (const std::int64_t most : {1'000'000, 20'000, 100, 5}) {
    const BalancedLattice balanced = fine_lattice({}, letters(), most);
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
  EXPECT_THROW(fine_lattice({}, letters(), 4), Error) << "fewer bins than objects";
}

TEST(BalancedLattice, OfAnEndlessRegionIsBoundedAndOfAnUnsoundMapIsRefused) {
  PoseLattice region;
  region.x_mm = {-farthest_mm, farthest_mm, 1};
  region.y_mm = {-farthest_mm, farthest_mm, 1};
  region.theta_rad = {1e9 - 6.0, 1e9, 1};
  const BalancedLattice balanced = fine_lattice(region, letters());
  EXPECT_TRUE(balanced.coarsened);
  EXPECT_LE(5 * balanced.lattice.bins(), most_balanced_bins);
  for (const Axis& x_mm : {Axis{1.0, -1.0, 1}, Axis{-1e200, 1e200, 1}}) {
    region.x_mm = x_mm;
    EXPECT_THROW(fine_lattice(region, letters()), Error);
  }
  EXPECT_THROW(fine_lattice({}, {}), Error);
  Hypothesis unsound = letter("O");
  unsound.map.cell_mm = 1e200;
  expect_named(input_error([&] { fine_lattice({}, std::span(&unsound, 1)); }), {"cell_mm"});
}

TEST(BalancedLattice, FitsTheDevice) {
  Device device = Device::open();
  const std::int64_t most = most_bins_on(device);
  EXPECT_EQ(most,
            std::min(static_cast<std::int64_t>(device.memory_bytes() / 16), most_balanced_bins));
  const PoseLattice region{{-0.9, 0.9, 1}, {-0.9, 0.9, 1}, {0.0, 0.3, 1}, {}};
  EXPECT_NO_THROW(
      PoseHistogram(device, letters(), {.lattice = fine_lattice(region, letters(), most).lattice}));
}

/// A map of this many cells of 0.5 mm around (x, y), of which the innermost 5 x 3 are occupied.
Hypothesis bar_at(double x, double y) {
  OccupancyGrid map{
      .label = "bar", .origin_mm = {x - 10.0, y - 8.0}, .nx = 41, .ny = 33, .log_odds = {}};
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      map.log_odds.push_back(std::abs(i - 20) <= 2 && std::abs(j - 16) <= 1 ? 0.1F : -4.0F);
    }
  }
  return {map, 1.0};
}

void expect_region(const PoseLattice& region, const glm::dvec2& lower, const glm::dvec2& upper) {
  EXPECT_DOUBLE_EQ(region.x_mm.lower, lower.x);
  EXPECT_DOUBLE_EQ(region.x_mm.upper, upper.x);
  EXPECT_DOUBLE_EQ(region.y_mm.lower, lower.y);
  EXPECT_DOUBLE_EQ(region.y_mm.upper, upper.y);
  EXPECT_TRUE(region.full_circle());
  EXPECT_EQ(region.pivot_mm, glm::dvec2(0.0));
}

TEST(TouchRegion, IsTheObjectsBoxesGrownByTheArray) {
  // Five cells by three, and 7 mm to every side.
  const glm::dvec2 half(1.25 + 7.0, 0.75 + 7.0);
  const Hypothesis bar = bar_at(3.0, -1.0);
  const TouchRegion one = touch_region(std::span(&bar, 1), 7.0);
  expect_region(one.lattice, glm::dvec2(3.0, -1.0) - half, glm::dvec2(3.0, -1.0) + half);
  EXPECT_DOUBLE_EQ(one.excess, 1.0);

  const std::vector<Hypothesis> apart{bar_at(-50.0, 0.0), bar_at(50.0, 0.0)};
  const TouchRegion both = touch_region(apart, 7.0);
  expect_region(both.lattice, glm::dvec2(-50.0, 0.0) - half, glm::dvec2(50.0, 0.0) + half);
  EXPECT_DOUBLE_EQ(both.excess, (100.0 + 16.5) / 16.5);
  EXPECT_DOUBLE_EQ(touch_region(letters(), 7.0).excess, 1.0) << "about one origin";

  Hypothesis empty = bar_at(0.0, 0.0);
  std::ranges::fill(empty.map.log_odds, -1.0F);
  expect_region(touch_region(std::span(&empty, 1), 0.0).lattice, {-10.25, -8.25}, {10.25, 8.25});
}

TEST(TouchRegion, RefusesAnArrayThatCannotBe) {
  EXPECT_THROW(touch_region({}, 1.0), Error);
  for (const double reach : {-1.0, std::nan(""), 2.0 * farthest_mm}) {
    EXPECT_THROW(touch_region(letters(), reach), Error) << reach;
  }
}

}  // namespace palpate::balanced_lattice_test
