#include "estimation/bounded/moving/tile_choice.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "estimation/bounded/moving/step_pace.hpp"

namespace palpate::tile_choice_test {

constexpr double none = -std::numeric_limits<double>::infinity();

TEST(TileChoice, TakesWhatMattersAndWhatIsNoNumber) {
  const std::vector<TileBeliefs> objects{
      {.bound = {-1.0, -3.0, std::numeric_limits<double>::quiet_NaN()}, .least = -2.0},
      {.bound = {-1.0, -3.0}, .least = -4.0}};
  EXPECT_EQ(all_that_matter(objects), (FollowedTiles{{1, 0, 1}, {1, 1}}));
}

/// An object of 100 tiles: the first ones have mass, the last ones loose bounds.
TileBeliefs object_of(double scale) {
  TileBeliefs object{.scale = scale, .least = -1000.0};
  for (int i = 0; i < 100; ++i) {
    object.bound.push_back(i < 60 ? -10.0 - i : 5.0 + i);
    object.known.push_back(i < 30 ? -10.0 - i : none);
    object.held.push_back(i < 20 ? -10.0 - i : none);
  }
  return object;
}

TEST(TileChoice, LeavesNothingOutWhereThereIsRoom) {
  const std::vector<TileBeliefs> objects{object_of(0.0)};
  FollowedTiles followed = all_that_matter(objects);
  EXPECT_FALSE(leave_best(100, objects, 40.0, followed));
  EXPECT_EQ(followed, all_that_matter(objects));
}

TEST(TileChoice, PrefersKnownMassToLooseBounds) {
  const std::vector<TileBeliefs> objects{object_of(0.0)};
  FollowedTiles followed = all_that_matter(objects);
  EXPECT_TRUE(leave_best(40, objects, 40.0, followed));
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(followed[0][i] == 1, i < 30 || i >= 90) << i;
  }
}

TEST(TileChoice, TakesNegligibleMassForNone) {
  const std::vector<TileBeliefs> objects{object_of(0.0)};
  FollowedTiles followed = all_that_matter(objects);
  EXPECT_TRUE(leave_best(40, objects, 9.5, followed));  // ten tiles, and thirty of loose bounds
  EXPECT_EQ(followed[0][9], 1);
  EXPECT_EQ(followed[0][19], 0) << "sixteen hold mass themselves";
  EXPECT_EQ(followed[0][70], 1);
  EXPECT_EQ(followed[0][69], 0);
}

TEST(TileChoice, LeavesEveryObjectSomeOfItsMass) {
  const std::vector<TileBeliefs> objects{object_of(0.0), object_of(-500.0)};
  FollowedTiles followed = all_that_matter(objects);
  EXPECT_TRUE(leave_best(20, objects, 40.0, followed));
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(followed[0][i] == 1, i < 20) << i;
    EXPECT_EQ(followed[1][i] == 1, i < 16) << i;
  }
}

TEST(StepPace, TellsTheTimeOfATileFromThatOfAllTouches) {
  StepPace pace;
  const double first = pace.tiles_within(true, 1.0);
  EXPECT_GT(first, 0.0);
  EXPECT_EQ(pace.tiles_within(true, 0.0), 0.0);
  pace.note(true, 1000, 0.3);  // 0.1 s, and 0.2 ms for each
  EXPECT_NEAR(pace.tiles_within(true, 1.2), 0.6 / 3e-4, 1e-6) << "half of the time";
  pace.note(true, 100, 0.12);
  EXPECT_NEAR(pace.tiles_within(true, 1.2), (0.6 - 0.1) / 2e-4, 1e-6);
  EXPECT_EQ(pace.tiles_within(true, 0.1), 0.0) << "not enough for what every touch takes";
  pace.note(false, 10, 1.0);
  EXPECT_NEAR(pace.tiles_within(true, 1.2), (0.6 - 0.1) / 2e-4, 1e-6) << "paces of their own";
}

TEST(StepPace, StaysWithinReasonWhereTimesAreOdd) {
  StepPace pace;
  pace.note(true, 0, 0.0);
  pace.note(true, 100, 0.5);
  pace.note(true, 1000, 0.2);
  const double tiles = pace.tiles_within(true, 1.0);
  EXPECT_GE(tiles, 0.0);
  EXPECT_LT(tiles, 1e7);
}

}  // namespace palpate::tile_choice_test
