// The bins at which an array overlaps an object, counted by rows, against the reference bin by bin.

#include "estimation/touch_overlap.hpp"

#include <algorithm>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "support/synthetic.hpp"

namespace palpate::touch_overlap_test {

/// What is counted in every row of y at a theta.
std::vector<RowBins> rows_of(const Touch& touch, const PoseLattice& lattice,
                             const OccupancyGrid& map, int theta) {
  const ArrayRectangle array =
      array_rectangle(touch.T_robot_sensor, touch.elements_mm, lattice.pivot_mm);
  std::vector<RowBins> rows(static_cast<std::size_t>(lattice.y_mm.count));
  find_overlap(array, occupied_box(map), lattice, theta, rows);
  return rows;
}

/// Expects every bin to be counted where the reference says that rectangles meet there.
/// @returns the number of such bins
std::int64_t expect_the_same_bins(const Touch& touch, const PoseLattice& lattice,
                                  const OccupancyGrid& map) {
  std::int64_t total = 0;
  std::int64_t bin = 0;
  for (int t = 0; t < lattice.theta_rad.count; ++t) {
    for (const RowBins& row : rows_of(touch, lattice, map, t)) {
      for (int x = 0; x < lattice.x_mm.count; ++x, ++bin) {
        const bool counted = x >= row.first && x < row.first + row.count;
        EXPECT_EQ(counted, reference::overlaps(touch, reference::bin_pose(lattice, bin), map))
            << "theta " << t << ", column " << x << ", bin " << bin;
        total += counted ? 1 : 0;
      }
    }
  }
  return total;
}

/// A map of a few cells above 0, in one corner.
OccupancyGrid corner_map(std::uint64_t seed) {
  OccupancyGrid map = random_map(21, 17, 0.7, 6.0, seed);
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (i > 6 || j > 9) {
        map.log_odds[static_cast<std::size_t>(j * map.nx + i)] = -1.0F;
      }
    }
  }
  return map;
}

TEST(ArrayOverlap, IsTheReferencesAtEveryBin) {
  const PoseLattice lattice{.x_mm = {-30.0, 28.0, 41},
                            .y_mm = {-25.0, 31.0, 37},
                            .theta_rad = {0.1, two_pi + 0.1, 13},
                            .pivot_mm = {3.0, -2.0}};
  for (std::uint64_t seed = 601; seed < 609; ++seed) {
    Recording recording = random_recording(1, 6, seed);
    for (glm::dvec2& element : recording.elements_mm) {
      element = element * glm::dvec2(2.0, 0.4) + glm::dvec2(5.0, -3.0);  // long, off its frame
    }
    const std::int64_t bins =
        expect_the_same_bins(recording.touch(0), lattice, corner_map(seed + 50));
    EXPECT_GT(bins, lattice.bins() / 20);
    EXPECT_LT(bins, lattice.bins() / 2);
  }
}

TEST(ArrayOverlap, AlongTheAxes) {
  // Sines and cosines of 0 and of nearly 0, and rectangles that touch exactly at some bins.
  Recording recording;
  recording.elements_mm = {{-4.0, -1.0}, {4.0, 1.0}};
  recording.pressure = {9.0, 9.0};
  OccupancyGrid map = random_map(8, 4, 1.0, 1.0, 621);
  std::ranges::fill(map.log_odds, 2.0F);
  map.origin_mm = {-3.5, -1.5};  // its box: [-4, 4] x [-2, 2] mm
  for (const double turn : {0.0, std::numbers::pi / 2, std::numbers::pi}) {
    recording.T_robot_sensor = {{{1.0, 0.0}, turn}};
    const PoseLattice quarters{
        .x_mm = {-12.5, 12.5, 25},
        .y_mm = {-8.5, 8.5, 17},
        .theta_rad = {-std::numbers::pi / 4, two_pi - std::numbers::pi / 4, 4}};
    const std::int64_t bins = expect_the_same_bins(recording.touch(0), quarters, map);
    // |x| <= 8, |y| <= 3 mm in two of the quarters and |x| <= 5, |y| <= 6 in the others.
    EXPECT_EQ(bins, 2 * 17 * 7 + 2 * 11 * 13);
  }
}

TEST(ArrayOverlap, OfOneElementOneBinOrAMapWithoutAnOccupiedCell) {
  const Recording recording = random_recording(4, 1, 631);
  OccupancyGrid empty = random_map(9, 7, 0.5, 1.0, 632);
  std::ranges::fill(empty.log_odds, -2.0F);
  PoseLattice lattice{.x_mm = {-9.0, 9.0, 19}, .y_mm = {-9.0, 9.0, 18}, .theta_rad = {0, 6, 5}};
  PoseLattice bin{.x_mm = {1.0, 1.0, 1}, .y_mm = {-4.0, 4.0, 1}, .theta_rad = {0.5, 0.5, 1}};
  std::int64_t bins = 0;
  std::int64_t ones = 0;
  for (const Touch& touch : all_touches(recording)) {
    bins += expect_the_same_bins(touch, lattice, empty);
    for (const double x : {-6.0, 0.0, 6.0}) {
      bin.x_mm = {x, x, 1};
      ones += expect_the_same_bins(touch, bin, random_map(21, 21, 0.5, 1.0, 633));
    }
  }
  EXPECT_GT(bins, 0);
  EXPECT_GT(ones, 0);
  EXPECT_LT(ones, 12);
}

TEST(ArrayOverlap, OfAnArrayBeyondAllMeasureIsEverywhere) {
  Recording recording;
  recording.elements_mm = {{-1e308, -1e308}, {1e308, 1e308}};
  recording.pressure = {9.0, 0.0};
  recording.T_robot_sensor = {{{0.0, 0.0}, 0.3}};
  const PoseLattice lattice{.x_mm = {-9, 9, 5}, .y_mm = {-9, 9, 4}, .theta_rad = {0, 6, 3}};
  for (int t = 0; t < 3; ++t) {
    for (const auto& row : rows_of(recording.touch(0), lattice, corner_map(641), t)) {
      EXPECT_EQ(row.count, lattice.x_mm.count);
    }
  }
}

}  // namespace palpate::touch_overlap_test
