#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "figures/figures.hpp"
#include "figures/view.hpp"
#include "picture.hpp"
#include "support/limits.hpp"

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

/// The scale of a row of cells with this evidence, in nats over the prior.
double range_of(const std::vector<float>& evidence, double prior = 0.5) {
  OccupancyGrid map{.prior = prior, .nx = static_cast<int>(evidence.size()), .ny = 1};
  for (const float nats : evidence) {
    map.log_odds.push_back(nats + static_cast<float>(map.prior_log_odds()));
  }
  return evidence_scale(std::span(&map, 1)).range_nats;
}

TEST(EvidenceScale, HoldsNineOfTenCellsThatHaveEvidenceRoundedUpToANumberWhoseHalfIsShort) {
  EXPECT_EQ(range_of({1.0F}), 1.0);
  EXPECT_EQ(range_of({1.01F}), 2.0);
  EXPECT_EQ(range_of({-5.0F}), 6.0);
  EXPECT_EQ(range_of({8.5F}), 10.0);
  // Nine of ten up to 3.9, one far beyond; then the ninth is beyond, too.
  std::vector<float> nats{0.1F, -0.2F, 0.3F, -0.4F, 0.5F, 0.6F, 0.7F, -0.8F, 3.9F, -3.9F, 70.0F};
  EXPECT_EQ(range_of(nats, 0.2), 4.0);
  std::erase(nats, -3.9F);
  EXPECT_EQ(range_of(nats, 0.2), 80.0);
  EXPECT_EQ(range_of({0.0F, 0.0F}), 1.0);
  std::vector<float> evidence(1000, 0.0F);
  evidence.resize(2000, 0.009F);  // a remnant of a Gaussian's tail
  evidence.push_back(static_cast<float>(infinity));
  EXPECT_EQ(range_of(evidence), 1.0);
  evidence.push_back(5.5F);
  EXPECT_EQ(range_of(evidence), 6.0);
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

TEST(DrawMaps, DrawsWhateverItsShapeAndLabelInTheSameBytes) {
  const OccupancyGrid one_cell = unseen("", 1, 1);
  OccupancyGrid infinite = unseen("a label much longer than the map below it is wide", 3, 200);
  infinite.log_odds[0] = static_cast<float>(infinity);
  infinite.log_odds[1] = -static_cast<float>(infinity);
  infinite.log_odds[2] = static_cast<float>(nan);
  const OccupancyGrid wide = unseen("\xFF\n", 500, 1);
  for (const OccupancyGrid& map : {one_cell, infinite, wide}) {
    const std::string png = draw(map);
    const Picture picture = decode(png);
    EXPECT_GT(picture.width, 300);
    EXPECT_GT(picture.height, 200);
    EXPECT_EQ(draw(map), png);
  }
  std::vector<OccupancyGrid> many(60, one_cell);
  many.insert(many.end(), {infinite, wide});
  decode(draw_maps(many));
}

}  // namespace palpate::map_figure_test
