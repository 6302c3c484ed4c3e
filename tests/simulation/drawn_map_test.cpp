// Maps of objects of which there is a drawing.

#include "palpate/drawn_map.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>

#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::drawn_map_test {

using testing::AllOf;
using testing::Each;
using testing::Ge;
using testing::Le;

constexpr double pixel_mm = 0.1;

Mask bar_mask() { return mask_of(*built_in_shape("bar"), pixel_mm); }

/// Share of a normal distribution about `centre` that lies between `from` and `to`.
double normal_share(double centre, double sd, double from, double to) {
  const auto below = [&](double x) {
    return 0.5 * std::erfc((centre - x) / (sd * std::numbers::sqrt2));
  };
  return below(to) - below(from);
}

TEST(DrawnMap, IsTheShareOfThePointSpreadOnTheObject) {
  const std::pair<DrawnMapOptions, double> felt_from[] = {
      {{.spread_mm = 0.25}, 0.2}, {{}, 0.2}, {{.spread_mm = 2.0}, 0.2}, {{.felt_share = 0.5}, 0.5}};
  for (const auto& [options, felt] : felt_from) {
    const double spread_mm = options.spread_mm;
    const OccupancyGrid map = drawn_map("bar", bar_mask(), options);
    for (int j = 0; j < map.ny; ++j) {
      for (int i = 0; i < map.nx; ++i) {
        const glm::dvec2 at = map.centre_mm(i, j);
        const double share = normal_share(at.x, 2.0 * spread_mm, -10.0, 10.0) *
                             normal_share(at.y, 2.0 * spread_mm, -4.0, 4.0);
        const double odds = std::pow(share / (1.0 - share) * (1.0 - felt) / felt, 2.0);
        const double p = share > 1.0 - 1e-9 ? options.peak : 0.001 + 0.998 * odds / (1.0 + odds);
        // A float32 share, which is cut off at five standard deviations.
        ASSERT_NEAR(map.at(i, j), std::log(p / (1.0 - p)), 2e-3) << at.x << "," << at.y;
      }
    }
  }
}

TEST(DrawnMap, CoversWhatAnArrayAboutTheOutlineSensesAndIsNoSurerThanItsPeak) {
  const OccupancyGrid map = drawn_map("bar", bar_mask(), {.peak = 0.9, .reach_mm = 5.0});
  constexpr double margin_mm = 2.0 * 5.0 + 4.0 * 0.5;
  EXPECT_NEAR(map.origin_mm.x, -10.0 - margin_mm, 0.5);
  EXPECT_NEAR(map.centre_mm(map.nx - 1, map.ny - 1).y, 4.0 + margin_mm, 0.5);
  EXPECT_EQ(std::remainder(map.origin_mm.x, map.cell_mm), 0.0) << "a whole multiple of the cell";
  const double most = std::log(9.0) + 1e-6;
  EXPECT_THAT(map.log_odds, Each(AllOf(Ge(-most), Le(most))));
  EXPECT_NEAR(map.at(map.nx / 2, map.ny / 2), std::log(9.0), 1e-3);
  EXPECT_TRUE(map.drawn);
  EXPECT_EQ(map.symmetry, 1);
  EXPECT_EQ(map.suggested_symmetry, 2);
}

TEST(DrawnMap, HasRowsAlongYAndColumnsAlongX) {
  // Two pixels of 2 mm: one at the origin, one above it and to the right.
  const Mask mask{.pixel_mm = 2.0,
                  .origin_mm = {1.0, -3.0},
                  .rows = 2,
                  .columns = 3,
                  .occupied = {1, 0, 0, 0, 0, 7}};
  const OccupancyGrid map = drawn_map("two", mask, {.cell_mm = 1.0});
  const auto at = [&](double x, double y) {
    return map.at(static_cast<int>(x - map.origin_mm.x), static_cast<int>(y - map.origin_mm.y));
  };
  EXPECT_GT(at(1.0, -3.0), 0.0F);
  EXPECT_GT(at(5.0, -1.0), 0.0F);
  EXPECT_LT(at(5.0, -3.0), 0.0F);
  EXPECT_LT(at(1.0, -1.0), 0.0F);
}

TEST(DrawnMap, RefusesWhatMakesNoMap) {
  const std::pair<const char*, DrawnMapOptions> of_options[] = {
      {"cell size = 0 mm", {.cell_mm = 0.0}},
      {"`peak 0.5`", {.peak = 0.5}},
      {"`felt-share 1`", {.felt_share = 1.0}},
      {"reach = -1 mm", {.reach_mm = -1.0}},
      {"no cell would be occupied", {.spread_mm = 30.0, .felt_share = 0.9}}};
  for (const auto& [named, options] : of_options) {
    expect_named(input_error([&] { drawn_map("bar", bar_mask(), options); }), {named});
  }
  const std::pair<const char*, Mask> of_masks[] = {
      {"a pixel = nan mm", {.pixel_mm = nan}},
      {"1 pixels in 2 rows of 2", {.rows = 2, .columns = 2, .occupied = {1}}},
      {"no pixel of 1 mm is occupied", {.rows = 1, .columns = 1, .occupied = {0}}},
      {"origin = nan,0 mm", {.origin_mm = {nan, 0.0}, .rows = 1, .columns = 1, .occupied = {1}}},
      {"an origin nearer", {.origin_mm = {1e9, 0.0}, .rows = 1, .columns = 1, .occupied = {1}}}};
  for (const auto& [named, mask] : of_masks) {
    expect_named(input_error([&] { drawn_map("bar", mask); }), {named});
  }
  const std::pair<const char*, std::vector<glm::dvec2>> of_polygons[] = {
      {"shape 'drawn': covers no area", {{0, 0}, {1, 1}, {2, 2}}},
      {"pixels of 0.1 mm are more than 1e+08", {{0, 0}, {9e5, 0}, {0, 9e5}}}};
  for (const auto& [named, polygon] : of_polygons) {
    const Shape shape{.label = "drawn", .strokes = {}, .polygons = {polygon}};
    expect_named(input_error([&] { mask_of(shape, pixel_mm); }), {named});
  }
}

}  // namespace palpate::drawn_map_test
