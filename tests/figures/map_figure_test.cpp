#include <limits>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "figures/figures.hpp"
#include "figures/map_layer.hpp"
#include "palpate/error.hpp"
#include "picture.hpp"

namespace palpate::map_figure_test {

OccupancyGrid unseen(const std::string& label, int nx, int ny) {
  OccupancyGrid map{
      .label = label, .cell_mm = 0.5, .origin_mm = {-2.0, 3.0}, .nx = nx, .ny = ny, .log_odds = {}};
  map.log_odds.assign(static_cast<std::size_t>(nx) * ny, static_cast<float>(map.prior_log_odds()));
  return map;
}

std::string draw(const OccupancyGrid& map) { return draw_maps(std::span(&map, 1)); }

TEST(MapLayer, ColoursEveryCellByItsDistanceFromThePrior) {
  OccupancyGrid map = unseen("A", 3, 2);
  const auto prior = static_cast<float>(map.prior_log_odds());
  map.log_odds = {prior, prior + 4, prior - 4, prior + 2, prior - 1, prior + 100};
  const EvidenceScale scale{4.0};
  Canvas canvas(60, 40);
  draw_cells(canvas, {{0.0, 0.0, 60.0, 40.0}, lower_edge_mm(map), upper_edge_mm(map)}, map, scale);
  const Picture picture = decode(canvas.encode());
  EXPECT_EQ(picture.at(10, 30), 0xFFFFFFu);
  EXPECT_EQ(picture.at(30, 30), rgb(diverging(1.0)));
  EXPECT_EQ(picture.at(50, 30), rgb(diverging(-1.0)));
  EXPECT_EQ(picture.at(10, 10), rgb(diverging(0.5)));
  EXPECT_EQ(picture.at(30, 10), rgb(diverging(-0.25)));
  EXPECT_EQ(picture.at(50, 10), rgb(diverging(1.0)));
}

TEST(EvidenceScale, CoversNineOfTenSeenCells) {
  OccupancyGrid map = unseen("A", 100, 10);
  for (std::size_t k = 0; k < 100; ++k) {
    map.log_odds[k] += k < 95 ? -3.7F : 1000.0F;
  }
  EXPECT_EQ(evidence_scale(std::span(&map, 1)).range_nats, 4.0);
}

TEST(EvidenceScale, IsFiniteWhereNothingWasSeen) {
  const OccupancyGrid map = unseen("A", 5, 5);
  EXPECT_EQ(evidence_scale(std::span(&map, 1)).range_nats, 1.0);
}

TEST(DrawMaps, LeavesUnseenCellsWhite) {
  const Picture picture = decode(draw(unseen("A", 20, 20)));
  int coloured = 0;
  for (const std::uint32_t pixel : picture.pixels) {
    const std::uint32_t red = pixel >> 16;
    const std::uint32_t blue = pixel & 0xFF;
    coloured += red != blue;
  }
  EXPECT_GT(coloured, 0);
  EXPECT_LE(coloured, 440 * 20) << "more than the colour bar";
}

TEST(DrawMaps, DrawsEachCellInItsPlaceWithYUp) {
  // One occupied cell at the lower left against one at the upper right: the pictures differ in
  // these two cells alone, whose rectangle is therefore the map.
  OccupancyGrid lower_left = unseen("A", 10, 10);
  OccupancyGrid upper_right = lower_left;
  lower_left.log_odds.front() += 4.0F;
  upper_right.log_odds.back() += 4.0F;
  const Picture a = decode(draw(lower_left));
  const Picture b = decode(draw(upper_right));
  const Difference d = difference(a, b);
  // A single map is 600 pixels wide, 60 for each cell; its frame, half a pixel on each side of its
  // edge, blends with the outermost pixels.
  EXPECT_NEAR(d.right - d.left + 1, 600, 2);
  EXPECT_NEAR(d.bottom - d.top + 1, 600, 2);
  EXPECT_NEAR(d.pixels, 2 * 60 * 60, 4 * 60);
  EXPECT_EQ(a.at(d.left + 30, d.bottom - 30), rgb(diverging(1.0)));
  EXPECT_EQ(a.at(d.right - 30, d.top + 30), 0xFFFFFFu);
  EXPECT_EQ(b.at(d.right - 30, d.top + 30), rgb(diverging(1.0)));
}

TEST(DrawMaps, WrapsIntoRowsOfAtMostSix) {
  const std::vector<OccupancyGrid> maps(7, unseen("A", 20, 20));
  const Picture six = decode(draw_maps(std::span(maps).first(6)));
  const Picture seven = decode(draw_maps(maps));
  EXPECT_LE(six.width, 1900);
  EXPECT_LE(seven.width, 1900);
  EXPECT_GT(six.width, 3 * six.height / 2);
  EXPECT_GT(seven.height, 3 * six.height / 2) << "two rows";
}

TEST(DrawMaps, DrawsWhateverItsShapeAndLabel) {
  OccupancyGrid one_cell = unseen("", 1, 1);
  OccupancyGrid infinite = unseen("a label much longer than the map below it is wide", 3, 200);
  infinite.log_odds[0] = std::numeric_limits<float>::infinity();
  infinite.log_odds[1] = -std::numeric_limits<float>::infinity();
  infinite.log_odds[2] = std::numeric_limits<float>::quiet_NaN();
  OccupancyGrid wide = unseen("\xFF\n", 500, 1);
  for (const OccupancyGrid& map : {one_cell, infinite, wide}) {
    const Picture picture = decode(draw(map));
    EXPECT_GT(picture.width, 300);
    EXPECT_GT(picture.height, 200);
  }
  decode(draw_maps(std::vector{one_cell, infinite, wide}));
  decode(draw_maps(std::vector<OccupancyGrid>(200, one_cell)));
}

TEST(DrawMaps, GivesTheSameBytesAgain) {
  OccupancyGrid map = unseen("A", 30, 30);
  map.log_odds[17] = 3.0F;
  EXPECT_EQ(draw(map), draw(map));
}

TEST(DrawMaps, RefusesWhatItCannotDraw) {
  EXPECT_THROW(draw_maps({}), Error);
  EXPECT_THROW(draw(unseen("A", 0, 5)), Error);
  OccupancyGrid short_of_values = unseen("A", 4, 5);
  short_of_values.log_odds.pop_back();
  EXPECT_THROW(draw(short_of_values), Error);
}

}  // namespace palpate::map_figure_test
