// The bounds of tiles against the likelihood of every bin in them: what a certificate rests on.

#include "estimation/bounded/tables/tile_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "bound_cases.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/tables/window_table.hpp"
#include "support/limits.hpp"
#include "support/trials.hpp"

namespace palpate::tile_bounds_test {

/// What checking the tiles of cases found.
struct Checked {
  std::int64_t tiles = 0;
  // Over tiles of the smallest level, in nats: bound less the largest bin of the tile.
  double looseness = 0.0;
  std::int64_t smallest = 0;
};

/// The largest of a box's bins in a plane.
double largest_in(const BinBox& box, const std::vector<double>& plane, const PoseLattice& lattice) {
  double largest = -infinity;
  for (int y = box.y_first; y < box.y_first + box.y_count; ++y) {
    const auto row = plane.begin() + std::ptrdiff_t{y} * lattice.x_mm.count + box.x_first;
    largest = std::accumulate(row, row + box.x_count, largest,
                              [](double a, double b) { return std::max(a, b); });
  }
  return largest;
}

/// Expects of all tiles of all levels that no bin in them exceeds the bound.
void check_case(const BinCase& of, std::size_t object, const std::vector<TileSize>& sizes,
                Checked& checked) {
  const std::vector<Hypothesis> hypotheses(2, {of.map, 1.0});
  const BinLikelihood likelihood(hypotheses, of.contact, of.lattice);
  const TileBounds bounds(of.map, of.contact, object, of.lattice, sizes);
  // Where no element has a penalty, bound and likelihood are the same sum in two orders.
  const double rounding = std::min(1e-9, likelihood.error(object, of.elements));
  for (int theta = 0; theta < of.lattice.theta_rad.count; ++theta) {
    const BinBox whole = whole_plane(of.lattice, theta, static_cast<int>(object));
    std::vector<double> plane(static_cast<std::size_t>(whole.bins()));
    likelihood.evaluate(std::span(&whole, 1), of.elements, plane);
    for_tiles(bounds, of, theta, [&](std::size_t l, const Tile& tile, double bound) {
      const BinBox box = bounds.levels()[l].box_of(tile);
      if (box.bins() == 0) {
        return;
      }
      const double largest = largest_in(box, plane, of.lattice);
      if (bound + rounding < largest && !testing::Test::HasFailure()) {
        ADD_FAILURE() << fmt::format("bound {} of {}: level {}, theta {}, tile {}, {} of {} bins",
                                     bound, largest, l, theta, tile.x, tile.y, box.bins());
      }
      ++checked.tiles;
      if (l + 1 == bounds.levels().size()) {
        checked.looseness += bound - largest;
        ++checked.smallest;
      }
    });
  }
}

TEST(TileBounds, HoldForEveryBinOfHundredsOfThousandsOfTiles) {
  Uniform random(401);
  Checked checked;
  for (int trial = 0; checked.tiles < trials(200'000) && !HasFailure(); ++trial) {
    SCOPED_TRACE(fmt::format("trial {}", trial));
    const BinCase of = random_bound_case(random);
    const std::size_t object = random_object(of, random);
    std::vector<TileSize> sizes = tile_sizes(of.lattice, of.map.cell_mm, 1);
    if (random(0.0, 8.0) < 1.0) {
      // As in very large regions.
      sizes = {{.side = 32}, {.side = 8}, {.side = 2}, {.square_cells = 0.5, .side = 1}};
    } else if (std::min(of.lattice.x_mm.step(), of.lattice.y_mm.step()) > 0.5 * of.map.cell_mm) {
      // Also where other tiles are better, and with squares of several cells.
      sizes = {{.side = random(0.0, 2.0) < 1.0 ? 1 : 4, .bins = 1}};
    }
    check_case(of, object, sizes, checked);
  }
}

TEST(TileBounds, HoldWithFarPivots) {
  // Elements 1e5 mm from the pivot, and bins that bring them back to the map.
  Uniform random(402);
  for (const double away_mm : {1e3, 1e5, 1e7}) {
    Checked checked;
    for (int trial = 0; checked.tiles < trials(50'000) && !HasFailure(); ++trial) {
      SCOPED_TRACE(fmt::format("{} mm away, trial {}", away_mm, trial));
      BinCase of = random_bound_case(random);
      of.lattice.theta_rad = {-1e-9, 1e-9, 3};
      of.lattice.x_mm.lower -= away_mm;
      of.lattice.x_mm.upper -= away_mm;
      for (glm::dvec2& p_mm : of.elements.from_pivot_mm) {
        p_mm.x += away_mm;
      }
      check_case(of, random_object(of, random), tile_sizes(of.lattice, of.map.cell_mm, 1), checked);
    }
  }
}

/// A hill whose log odds fall from 3 to -3 within some 8 mm, by 0.23 nats a cell at most.
OccupancyGrid smooth_hill() {
  OccupancyGrid map = random_map(81, 81, 0.5, 1.0, 403);
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      const double mm = std::hypot(map.centre_mm(i, j).x, map.centre_mm(i, j).y);
      map.log_odds[static_cast<std::size_t>(j) * map.nx + i] =
          static_cast<float>(6.0 * std::exp(-mm * mm / 128.0) - 3.0);
    }
  }
  return map;
}

TEST(TileBounds, AreCloseOnASmoothMap) {
  BinCase of = letter_case();
  of.map = smooth_hill();
  of.lattice = {.x_mm = {-8.0, 8.0, 160}, .y_mm = {-8.0, 8.0, 160}, .theta_rad = {0.0, two_pi, 3}};
  Checked checked;
  check_case(of, 0, tile_sizes(of.lattice, of.map.cell_mm, 1), checked);
  ASSERT_GT(checked.smallest, 10'000);
  // A window of the smallest tiles is a cell wide: the log odds of its most likely place are at
  // most some 0.23 nats from its middle's, on the average over places and directions a quarter of
  // that, and the likelihood's logs are less steep. Penalties of 0 would be some 1.5 nats off.
  const double elements = static_cast<double>(of.elements.from_pivot_mm.size());
  const double mean = checked.looseness / static_cast<double>(checked.smallest) / elements;
  EXPECT_LT(mean, 0.06) << "nats per element";
  EXPECT_GE(mean, 0.0);
}

void expect_partition(const TileAxis& axis, const Axis& bins) {
  ASSERT_EQ(axis.tiles() % batch_side, 0);
  ASSERT_EQ(axis.first_bin.front(), 0);
  ASSERT_EQ(axis.first_bin.back(), bins.count);
  for (int tile = 0; tile < axis.tiles(); ++tile) {
    ASSERT_GE(axis.bins(tile), 0);
    for (int bin = axis.first_bin[tile]; bin < axis.first_bin[tile + 1]; ++bin) {
      // A bin at a tile's corner may be in either, for rounding.
      const double place = (bins.centre(bin) - axis.first_mm) / axis.side_mm;
      const double rounding = 1e-12 * (1.0 + std::abs(bins.centre(bin)) / axis.side_mm);
      ASSERT_NEAR(place, tile + 0.5, 0.5 + rounding) << "bin " << bin;
    }
  }
}

/// Four tiles in a row make up one of the level above.
void expect_children(const TileAxis& parents, const TileAxis& children) {
  ASSERT_EQ(parents.side_mm, batch_side * children.side_mm);
  for (int tile = 0; tile < parents.tiles(); ++tile) {
    if (parents.bins(tile) == 0) {
      continue;
    }
    ASSERT_LE(batch_side * (tile + 1), children.tiles())
        << "tile " << tile << " of " << parents.side_mm << " mm has bins, but no children";
    ASSERT_EQ(children.first_bin[batch_side * tile], parents.first_bin[tile]);
    ASSERT_EQ(children.first_bin[batch_side * (tile + 1)], parents.first_bin[tile + 1]);
  }
}

void expect_partitions(const PoseLattice& lattice, double cell_mm,
                       const std::vector<TileSize>& sizes) {
  const std::vector<TileLevel> levels = tile_levels(lattice, cell_mm, sizes);
  for (std::size_t l = 0; l < levels.size(); ++l) {
    expect_partition(levels[l].x, lattice.x_mm);
    expect_partition(levels[l].y, lattice.y_mm);
    if (l > 0) {
      expect_children(levels[l - 1].x, levels[l].x);
      expect_children(levels[l - 1].y, levels[l].y);
    }
  }
}

TEST(TileLevels, PutEveryBinIntoOneTileAndPartIt) {
  Uniform random(404);
  for (int trial = 0; trial < trials(700) && !HasFatalFailure(); ++trial) {
    SCOPED_TRACE(fmt::format("trial {}", trial));
    const BinCase of = random_bound_case(random);
    expect_partitions(of.lattice, of.map.cell_mm, tile_sizes(of.lattice, of.map.cell_mm, 1));
    expect_partitions(of.lattice, of.map.cell_mm,
                      {{.side = 128}, {.side = 32}, {.side = 8}, {.side = 2}});
  }
}

TEST(TileLevels, DoSoWhereBinsLieOnTheTilesCorners) {
  // Steps that divide a tile's side but for rounding: the last bin is at a corner.
  for (const double cell_mm : {0.125, 0.1, 0.37, 1.0 / 3.0}) {
    for (int parts = 1; parts <= 120 && !HasFatalFailure(); ++parts) {
      for (int sides = 1; sides <= 5 && !HasFatalFailure(); ++sides) {
        SCOPED_TRACE(fmt::format("cells of {} mm, {} tiles of {} bins", cell_mm, sides, parts));
        const int count = sides * parts + 1;
        const double width_mm = count * (8.0 * cell_mm / parts);
        const PoseLattice lattice{.x_mm = {0.0, width_mm, count},
                                  .y_mm = {-0.5 * width_mm, 0.5 * width_mm, count}};
        expect_partitions(lattice, cell_mm, tile_sizes(lattice, cell_mm, 1));
      }
    }
  }
}

TEST(TileLevels, AreOfSingleBinsWhereTheseAreSparseAndFew) {
  const auto largest_size = [](double step_x_mm, double step_y_mm, int count, std::size_t maps) {
    const PoseLattice lattice{.x_mm = {0.0, count * step_x_mm, count},
                              .y_mm = {0.0, count * step_y_mm, count},
                              .theta_rad = {0.0, two_pi, 36}};
    return tile_sizes(lattice, 0.95, maps).front();
  };
  // Squares as large as a cell or a little smaller.
  EXPECT_EQ(largest_size(3.33, 3.44, 20, 110).bins, 1);
  EXPECT_EQ(largest_size(3.33, 3.44, 20, 110).side, 4);
  EXPECT_EQ(largest_size(2.0, 2.0, 20, 1).side, 4);
  EXPECT_EQ(largest_size(2.0, 60.0, 20, 1).side, 16) << "their area counts";
  EXPECT_EQ(largest_size(1e3, 1e3, 20, 1).side, 16) << "so that tables stay small";
  // Bins that lie closer, along one axis, and more of them than are kept.
  EXPECT_NE(largest_size(1.8, 3.44, 20, 110).bins, 1);
  EXPECT_NE(largest_size(3.33, 1.8, 20, 110).bins, 1);
  EXPECT_NE(largest_size(3.33, 3.44, 50, 110).bins, 1);
}

TEST(TileLevels, AreNotDividedWhereTheyHoldFewBins) {
  const auto smallest_cells = [](double step_x_mm, double step_y_mm, int count_y) {
    const PoseLattice lattice{.x_mm = {0.0, 40.0 * step_x_mm, 40},
                              .y_mm = {0.0, count_y * step_y_mm, count_y},
                              .theta_rad = {0.0, two_pi, 16}};
    return tile_sizes(lattice, 0.5, 5).back().cells();
  };
  EXPECT_EQ(smallest_cells(0.5, 0.5, 40), 0.5) << "tiles of 2 cells hold 4 bins";
  EXPECT_EQ(smallest_cells(0.8, 0.8, 40), 2.0) << "1.6";
  EXPECT_EQ(smallest_cells(0.2, 0.8, 40), 0.5) << "6.25";
  EXPECT_EQ(smallest_cells(0.5, 0.0, 1), 2.0) << "2, as y is fixed";
}

TEST(TileLevels, AreSoLargeThatTheLargestTilesFitMemory) {
  PoseLattice lattice;
  for (const double half_mm : {0.0, 10.0, 1e3, 1e5}) {
    lattice.x_mm = lattice.y_mm = {-half_mm, half_mm, half_mm == 0.0 ? 1 : 40'000};
    lattice.theta_rad.count = 360;
    const std::vector<TileSize> sizes = tile_sizes(lattice, 0.5, 20);
    for (std::size_t l = 1; l < sizes.size(); ++l) {
      EXPECT_EQ(sizes[l - 1].cells(), batch_side * sizes[l].cells());
    }
    const double tiles = std::pow(2.0 * half_mm / (0.5 * sizes.front().cells()), 2.0) * 360 * 20;
    // 1e7 tiles of 4 bytes, unless the tiles are the largest that there are.
    EXPECT_TRUE(tiles <= 1e7 || sizes.front().side == 512) << tiles;
  }
}

}  // namespace palpate::tile_bounds_test
