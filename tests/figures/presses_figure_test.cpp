#include "figures/figures.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "picture.hpp"

namespace palpate::presses_figure_test {

/// A map whose middle cell is occupied, with two presses.
DrawnPresses example() {
  OccupancyGrid map;
  map.label = "A";
  map.cell_mm = 2.0;
  map.origin_mm = {-10.0, -10.0};
  map.nx = map.ny = 11;
  map.log_odds.assign(121, -3.0F);
  map.log_odds[60] = 3.0F;
  const DrawnPress press{.caption = "0", .contacts_mm = {{0.0, 0.0}}};
  return {.title = "A", .map = map, .presses = {press, press}};
}

Picture drawn(const DrawnPresses& group) { return decode(draw_presses(std::vector{group})); }

TEST(PressesFigure, GivesTheSameBytesAgain) {
  EXPECT_EQ(draw_presses(std::vector{example()}), draw_presses(std::vector{example()}));
}

TEST(PressesFigure, AnElementCoversItsTileAlone) {
  DrawnPresses group = example();
  const Picture before = drawn(group);
  group.presses[1].contacts_mm.clear();
  const Difference change = difference(before, drawn(group));
  EXPECT_GT(change.pixels, 100);
  EXPECT_LT(change.right - change.left, 240) << "the edge of a tile";
  EXPECT_LT(change.bottom - change.top, 240);
}

TEST(PressesFigure, DrawsPressesWithoutAMap) {
  const DrawnPresses group{
      .title = "left out",
      .presses = {{.caption = "0", .contacts_mm = {{1.0, 1.0}}}, {.caption = "nothing"}}};
  EXPECT_GT(drawn(group).width, 0);
}

TEST(PressesFigure, RefusesNothingToDraw) { EXPECT_THROW(draw_presses({}), Error); }

}  // namespace palpate::presses_figure_test
