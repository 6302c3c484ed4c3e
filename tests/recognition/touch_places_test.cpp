// How much touches tell beside earlier ones, by how far from these they are.

#include "recognition/touch_places.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "recognition/recogniser.hpp"
#include "shapes.hpp"
#include "support/synthetic.hpp"

namespace palpate::touch_places_test {

constexpr double spacing_mm = 1.9;

/// A touch by a pad of 6 x 6 elements of which the first so many are In Contact.
TouchEvidence touch_at(const Pose& T_robot_sensor, std::size_t contacts = 10) {
  static const std::vector<glm::dvec2> elements_mm = grid_array(6, 6, spacing_mm);
  std::vector<double> pressure(elements_mm.size());
  std::fill_n(pressure.begin(), contacts, 10.0);
  return {{T_robot_sensor, elements_mm, pressure}, {}};
}

/// The known elements of a touch among all.
double share(const TouchEvidence& touch) {
  return static_cast<double>(touch.known().readings.size()) /
         static_cast<double>(touch.readings.size());
}

/// The shares of touches in this order.
std::vector<double> shares(std::initializer_list<TouchEvidence> touches) {
  TouchPlaces places;
  std::vector<double> found;
  for (const TouchEvidence& touch : touches) {
    found.push_back(share(places.add(touch)));
  }
  return found;
}

constexpr double an_element = 1.5 / 36.0;

TEST(TouchPlaces, CountATouchThatIsWrittenAgainOnce) {
  const TouchEvidence touch = touch_at({{3.0, 4.0}, 0.5});
  EXPECT_EQ(shares({touch, touch, touch}), (std::vector{1.0, 0.0, 0.0}));
}

TEST(TouchPlaces, CountFurtherTouchesByTheSquareOfTheirDistance) {
  const auto at = [](double x_mm) { return touch_at({{x_mm, 0.0}, 0.0}); };
  EXPECT_NEAR(shares({at(0.0), at(0.5 * spacing_mm)})[1], 0.25, an_element);
  EXPECT_NEAR(shares({at(0.0), at(-0.8 * spacing_mm)})[1], 0.64, an_element);
  EXPECT_EQ(shares({at(0.0), at(1.001 * spacing_mm)})[1], 1.0);
  EXPECT_EQ(shares({at(0.0), at(0.999 * spacing_mm)})[0], 1.0);
}

TEST(TouchPlaces, TurnTheArrayAboutItsMiddle) {
  // The elements of 6 x 6 lie sqrt(35 / 6) spacings from the middle, root mean square.
  const double lever = std::sqrt(35.0 / 6.0);
  const auto turned = [&](double spacings) {
    return touch_at({{20.0, 0.0}, 2.0 * std::asin(0.5 * spacings / lever)});
  };
  EXPECT_NEAR(shares({turned(0.0), turned(0.6)})[1], 0.36, an_element);
  EXPECT_EQ(shares({turned(0.0), turned(1.001)})[1], 1.0);
}

TEST(TouchPlaces, GiveAPlaceAboutOneTouchInAll) {
  std::vector<double> found = shares({touch_at({{0.0, 0.0}, 0.0}), touch_at({{0.5, 0.0}, 0.0}),
                                      touch_at({{0.0, 0.5}, 0.0}), touch_at({{0.5, 0.5}, 0.0}),
                                      touch_at({{0.2, 0.3}, 0.0}), touch_at({{0.3, 0.1}, 0.0})});
  EXPECT_LT(std::accumulate(found.begin(), found.end(), 0.0), 1.2);
  // What counts for little hides little: a slide counts by its length.
  TouchPlaces places;
  double sum = 0.0;
  for (int i = 0; i < 40; ++i) {
    sum += share(places.add(touch_at({{0.25 * spacing_mm * i, 0.0}, 0.0})));
  }
  EXPECT_GT(sum, 8.0);
  EXPECT_LT(sum, 16.0);
}

TEST(TouchPlaces, LetAPressTellItsOwnAfterAMereBrush) {
  EXPECT_EQ(shares({touch_at({}, 0), touch_at({}, 12)})[1], 1.0);
  EXPECT_NEAR(shares({touch_at({}, 2), touch_at({}, 12)})[1], 1.0 - 4.0 / 12.0, an_element);
  EXPECT_EQ(shares({touch_at({}, 6), touch_at({}, 12)})[1], 0.0);
  EXPECT_EQ(shares({touch_at({}, 12), touch_at({}, 0)})[1], 0.0);
  EXPECT_EQ(shares({touch_at({}, 0), touch_at({}, 0)})[1], 0.0);
}

TEST(TouchPlaces, ForgetTouchesAndLookAhead) {
  TouchPlaces places;
  places.add(touch_at({}));
  EXPECT_EQ(share(places.weighed(touch_at({}))), 0.0);
  EXPECT_EQ(share(places.weighed(touch_at({{9.0, 0.0}, 0.0}))), 1.0);
  EXPECT_EQ(share(places.add(touch_at({{9.0, 0.0}, 0.0}))), 1.0) << "looking ahead keeps nothing";
  places.clear();
  EXPECT_EQ(share(places.add(touch_at({}))), 1.0);
}

TEST(TouchPlaces, TouchesOfOnePoseAreNotEqualWhereTheirPressuresDiffer) {
  static const std::vector<glm::dvec2> elements_mm = grid_array(6, 6, spacing_mm);
  TouchPlaces places;
  for (const double kpa : {10.0, 11.0}) {
    std::vector<double> pressure(elements_mm.size());
    std::fill_n(pressure.begin(), 9, kpa);
    places.add({{{}, elements_mm, pressure}, {}});
  }
  EXPECT_EQ(places.words().find("equal an earlier one"), std::string::npos) << places.words();
  EXPECT_NE(places.words(), "") << "they lie close together";
}

TEST(TouchPlaces, SayWhichTouchesAreWrittenAgainOrLieClose) {
  TouchPlaces places;
  for (int i = 0; i < 3; ++i) {
    places.add(touch_at({{9.0 * i, 0.0}, 0.0}));
    EXPECT_EQ(places.words(), "");
  }
  places.add(touch_at({{9.0, 0.0}, 0.0}));
  EXPECT_EQ(places.words(),
            "1 of 4 touches equal an earlier one to the digit, and count as one with it: import "
            "each touch once");
  places.clear();
  places.add(touch_at({}));
  places.add(touch_at({{0.1, 0.0}, 0.0}));
  EXPECT_EQ(places.words(), "");
  places.add(touch_at({{0.0, 0.1}, 0.0}));
  EXPECT_NE(places.words().find("3 touches lie so close together that they count as 1.0"),
            std::string::npos)
      << places.words();
}

TEST(TouchPlaces, AreCountedByEveryFilterAlike) {
  Device device = Device::open();
  const Recording recording = touched_letter(1);
  const Touch touch = recording.touch(0);
  for (const FilterOptions& filter : every_filter()) {
    RecognitionTask task(shapes(), filter);
    const auto told = [&](std::span<const Touch> touches) {
      Recogniser recogniser(device, task);
      recogniser.update(touches);
      return recogniser.estimate().identity[0];
    };
    const double once = told(std::vector{touch});
    const std::vector<Touch> again(9, touch);
    EXPECT_GT(std::abs(told(again) - once), 1e-3) << "as in the paper, all touches multiply";
    task.by_place = true;
    EXPECT_NEAR(told(again), once, 1e-9);
  }
}

}  // namespace palpate::touch_places_test
