// Axes, and where labels find room.

#include "figures/view.hpp"

#include <gtest/gtest.h>

#include "figures/label_places.hpp"
#include "picture.hpp"

namespace palpate::view_test {

std::vector<std::string> labels(const std::vector<Tick>& ticks) {
  std::vector<std::string> result;
  for (const Tick& tick : ticks) {
    result.push_back(tick.label);
  }
  return result;
}

using Labels = std::vector<std::string>;

TEST(EvenTicks, AreOneTwoOrFiveTimesAPowerOfTenAndNoCloserThanTheSmallestStep) {
  EXPECT_EQ(labels(even_ticks(-10.0, 10.0, 5)), (Labels{"−10", "−5", "0", "5", "10"}));
  EXPECT_EQ(labels(even_ticks(0.0, 1.0, 5)), (Labels{"0", "0.2", "0.4", "0.6", "0.8", "1"}));
  EXPECT_EQ(labels(even_ticks(-0.011, 0.012, 3)), (Labels{"−0.01", "0", "0.01"}));
  EXPECT_EQ(labels(even_ticks(130.0, 1700.0, 4)), (Labels{"500", "1000", "1500"}));
  EXPECT_EQ(labels(even_ticks(0.5, 1.5, 10, 1.0)), (Labels{"1"}));
  EXPECT_EQ(labels(even_ticks(0.5, 3.5, 10, 1.0)), (Labels{"1", "2", "3"}));
  // 6 * 0.1 is a little more than 0.6, which is a multiple of the step.
  EXPECT_EQ(labels(even_ticks(6 * 0.1, 1.4, 4)), (Labels{"0.6", "0.8", "1", "1.2", "1.4"}));
}

TEST(EvenTicks, AreNeverMoreThanAskedFor) {
  for (const double upper : {0.013, 0.7, 1.0, 3.3, 20.0, 99.0, 12345.0}) {
    for (int count = 1; count <= 12; ++count) {
      EXPECT_LE(even_ticks(-0.37 * upper, upper, count).size(), count + 1u);
      EXPECT_GE(even_ticks(0.0, upper, count).size(), 1u);
    }
  }
  EXPECT_LE(even_ticks(1e16, 1e16 + 4.0, 7).size(), 8u) << "steps drown in rounding";
}

TEST(View, MapsDataToPixelsWithYUp) {
  const View view{.box = {100.0, 50.0, 200.0, 80.0}, .lower = {-1.0, 4.0}, .upper = {1.0, 8.0}};
  EXPECT_EQ(view.pixel({-1.0, 4.0}), glm::dvec2(100.0, 130.0));
  EXPECT_EQ(view.pixel({1.0, 8.0}), glm::dvec2(300.0, 50.0));
  EXPECT_EQ(view.pixel({0.0, 7.0}), glm::dvec2(200.0, 70.0));
  const Box box = view.pixels({0.0, 4.0}, {1.0, 5.0});
  EXPECT_EQ(glm::dvec2(box.left, box.top), glm::dvec2(200.0, 110.0));
  EXPECT_EQ(glm::dvec2(box.width, box.height), glm::dvec2(100.0, 20.0));
}

TEST(DrawAxes, KeepTheLabelClearOfWideTicks) {
  const View view{.box = {300.0, 20.0, 100.0, 100.0}, .lower = {0.0, 0.0}, .upper = {1.0, 1.0}};
  const std::string wide = "1.23456e+123 and more";
  const auto drawn = [&](const char* label) {
    Canvas canvas(420, 200);
    draw_axes(canvas, view, {}, {{0.5, wide}}, "", label);
    return decode(canvas.encode());
  };
  Canvas canvas(1, 1);
  const double ticks_left = view.box.left - 10.0 - canvas.text_width(wide, small);
  const Difference label = difference(drawn(""), drawn("label"));
  EXPECT_GT(label.pixels, 0);
  EXPECT_LT(label.right, ticks_left);
}

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

}  // namespace palpate::view_test
