#include "figures/label_places.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace palpate::label_places_test {

bool overlap(const Box& a, const Box& b) {
  return a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom();
}

TEST(LabelPlaces, OfMarksOnOneAnotherCoverNeitherMarksNorEachOther) {
  const Box room{0.0, 0.0, 480.0, 480.0};
  std::vector<Box> marks;
  std::vector<PlacedLabel> labels;
  for (int k = 0; k < 5; ++k) {
    marks.push_back({200.0 + 5.0 * k, 220.0 - 3.0 * k, 30.0, 20.0});
    labels.push_back({marks.back(), {60.0, 18.0}});
  }
  const std::vector<Box> places = places_of(labels, marks, room);
  ASSERT_EQ(places.size(), 5U);
  for (std::size_t i = 0; i < places.size(); ++i) {
    EXPECT_EQ(places[i].width, 60.0);
    for (std::size_t k = 0; k < places.size(); ++k) {
      EXPECT_FALSE(overlap(places[i], marks[k])) << i << " " << k;
      EXPECT_FALSE(i != k && overlap(places[i], places[k])) << i << " " << k;
    }
  }
}

TEST(LabelPlaces, LieRightAboveUnlessTheRoomEndsThereOrIsTooSmall) {
  const Box mark{50.0, 50.0, 20.0, 20.0};
  const auto place_in = [&](const Box& room) {
    return places_of(std::vector{PlacedLabel{mark, {60.0, 18.0}}}, std::vector{mark}, room).front();
  };
  const Box free = place_in({0.0, 0.0, 480.0, 480.0});
  EXPECT_GT(free.left + free.width / 2.0, mark.right());
  EXPECT_LT(free.bottom(), mark.top);
  const Box corner = place_in({0.0, 45.0, 80.0, 480.0});
  EXPECT_LE(corner.right(), 80.0);
  EXPECT_GE(corner.top, 45.0);
  EXPECT_LT(place_in({40.0, 40.0, 40.0, 40.0}).bottom(), 50.0);
}

}  // namespace palpate::label_places_test
