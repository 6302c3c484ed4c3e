#include "figures/map_outline.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "picture.hpp"

namespace palpate::map_outline_test {

/// Cells of 0.5 mm whose rows are given from below: '#' is occupied.
OccupancyGrid map_of(const std::vector<std::string>& rows) {
  OccupancyGrid map;
  map.origin_mm = {-1.0, 2.0};
  map.cell_mm = 0.5;
  map.nx = static_cast<int>(rows.front().size());
  map.ny = static_cast<int>(rows.size());
  for (const std::string& row : rows) {
    for (const char cell : row) {
      map.log_odds.push_back(cell == '#' ? 1.0F : -1.0F);
    }
  }
  return map;
}

TEST(MapOutline, OfABlockRunsBetweenItsCellsAndTheOthers) {
  const auto outlines = outlines_of(map_of({"......", ".####.", ".####.", "......"}));
  ASSERT_EQ(outlines.size(), 1U);
  // Four by two cells without four corners, of an eighth of a cell each.
  EXPECT_NEAR(area(outlines[0]), (8.0 - 4.0 / 8.0) * 0.25, 1e-12);
  EXPECT_EQ(outlines[0].size(), 12U);
}

TEST(MapOutline, IsAsLongAsTheShapeAndNoRectangleAboutIt) {
  const auto outlines = outlines_of(map_of({"#####", "#....", "#....", "#####"}));
  ASSERT_EQ(outlines.size(), 1U);
  EXPECT_LT(area(outlines[0]), 13.0 * 0.25);
  EXPECT_GT(area(outlines[0]), 11.0 * 0.25);
}

TEST(MapOutline, RunsAboutHolesTheOtherWay) {
  const auto outlines = outlines_of(map_of({"####", "#..#", "#..#", "####", "....", "##.."}));
  ASSERT_EQ(outlines.size(), 3U);
  EXPECT_EQ(std::ranges::count_if(outlines, [](const auto& o) { return area(o) < 0.0; }), 1);
}

TEST(MapOutline, MeetsEdgesOfTheGridAndHoldsNothingWhereNothingIsOccupied) {
  EXPECT_TRUE(outlines_of(map_of({"...", "..."})).empty());
  const auto outlines = outlines_of(map_of({"##", "##"}));
  ASSERT_EQ(outlines.size(), 1U);
  EXPECT_NEAR(area(outlines[0]), (4.0 - 4.0 / 8.0) * 0.25, 1e-12);
}

TEST(MapOutline, JoinsCellsThatMeetAtACorner) {
  EXPECT_EQ(outlines_of(map_of({"#.", ".#"})).size(), 1U);
}

}  // namespace palpate::map_outline_test
