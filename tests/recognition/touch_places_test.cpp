// How much touches tell beside earlier ones, by how far from these they are, and where others may
// be planned.

#include "recognition/recogniser.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "recognition/touch_plan.hpp"
#include "shapes.hpp"

namespace palpate::touch_places_test {

constexpr double spacing_mm = 1.9;

/// A touch by a pad of 6 x 6 elements of which the first so many are In Contact.
TouchEvidence touch_at(const Pose& T_robot_sensor, std::size_t contacts = 10, double kpa = 10.0) {
  static const std::vector<glm::dvec2> elements_mm = grid_array(6, 6, spacing_mm);
  std::vector<double> pressure(elements_mm.size());
  pressure.front() = 0.5;  // without a pressure nothing is known
  std::fill_n(pressure.begin(), contacts, kpa);
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

TEST(TouchPlaces, LeaveATouchItsWeightWhereOneBeforeItTellsNothing) {
  const double unknown = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(shares({touch_at({}, 36, unknown), touch_at({}, 0)}), (std::vector{0.0, 35.0 / 36.0}));
}

TEST(TouchPlaces, CountFurtherTouchesByTheSquareOfTheirDistance) {
  // The elements of 6 x 6 lie sqrt(35 / 6) spacings from the middle, root mean square.
  const double lever = std::sqrt(35.0 / 6.0);
  const auto moved = [](double spacings) { return touch_at({{spacings * spacing_mm, 0.0}, 0.0}); };
  const auto turned = [&](double spacings) {
    return touch_at({{20.0, 0.0}, 2.0 * std::asin(0.5 * spacings / lever)});
  };
  EXPECT_NEAR(shares({moved(0.0), moved(0.5)})[1], 0.25, an_element);
  EXPECT_NEAR(shares({moved(0.0), moved(-0.8)})[1], 0.64, an_element);
  EXPECT_NEAR(shares({turned(0.0), turned(0.6)})[1], 0.36, an_element);
  EXPECT_EQ(shares({moved(0.0), moved(1.001)})[1], 1.0);
  EXPECT_EQ(shares({turned(0.0), turned(1.001)})[1], 1.0);
  EXPECT_EQ(shares({moved(0.0), moved(0.999)})[0], 1.0);
}

TEST(TouchPlaces, GiveAPlaceAboutOneTouchInAll) {
  TouchPlaces places;
  double sum = 0.0;
  for (const glm::dvec2& at_mm :
       {glm::dvec2(0.0), {0.5, 0.0}, {0.0, 0.5}, {0.5, 0.5}, {0.2, 0.3}, {0.3, 0.1}}) {
    sum += share(places.add(touch_at({at_mm, 0.0})));
  }
  EXPECT_LT(sum, 1.2);
  // What counts for little hides little: a slide counts by its length.
  places.clear();
  sum = 0.0;
  for (int i = 0; i < 40; ++i) {
    sum += share(places.add(touch_at({{0.25 * spacing_mm * i, 0.0}, 0.0})));
  }
  EXPECT_GT(sum, 8.0);
  EXPECT_LT(sum, 16.0);
}

TEST(TouchPlaces, LetAPressTellItsOwnAfterAMereBrush) {
  const auto second = [](std::size_t contacts, std::size_t then) {
    return shares({touch_at({}, contacts), touch_at({}, then)})[1];
  };
  EXPECT_EQ(second(0, 12), 1.0);
  EXPECT_NEAR(second(2, 12), 1.0 - 4.0 / 12.0, an_element);
  EXPECT_EQ(second(6, 12), 0.0);
  EXPECT_EQ(second(12, 0), 0.0);
  EXPECT_EQ(second(0, 0), 0.0);
}

TEST(TouchPlaces, ForgetTouches) {
  TouchPlaces places;
  places.add(touch_at({}));
  EXPECT_EQ(share(TouchPlaces(places).add(touch_at({}))), 0.0);
  EXPECT_EQ(share(places.add(touch_at({{9.0, 0.0}, 0.0}))), 1.0);
  places.clear();
  EXPECT_EQ(share(places.add(touch_at({}))), 1.0);
}

TEST(TouchPlaces, SayWhichTouchesAreWrittenAgainOrLieClose) {
  TouchPlaces places;
  for (int i = 0; i < 3; ++i) {
    places.add(touch_at({{9.0 * i, 0.0}, 0.0}));
    EXPECT_EQ(places.words(), "");
  }
  places.add(touch_at({{9.0, 0.0}, 0.0}));
  EXPECT_NE(places.words().find("1 of 4 touches equal an earlier one"), std::string::npos);
  places.clear();
  places.add(touch_at({}));
  places.add(touch_at({{0.1, 0.0}, 0.0}));
  EXPECT_EQ(places.words(), "");
  places.add(touch_at({{0.0, 0.1}, 0.0}));
  EXPECT_NE(places.words().find("3 touches lie so close together that they count as 1.0"),
            std::string::npos)
      << places.words();
  places.clear();
  places.add(touch_at({}));
  places.add(touch_at({}, 10, 11.0));  // of another pressure, and so no equal
  EXPECT_NE(places.words().find("2 touches lie so close"), std::string::npos) << places.words();
}

class TouchPlacesOfARecogniser : public ByEveryFilter {};

TEST_P(TouchPlacesOfARecogniser, CountATouchThatIsWrittenAgainOnce) {
  const Recording recording = touched_letter(1);
  RecognitionTask task(shapes(), filter());
  const auto told = [&](std::size_t times) {
    Recogniser recogniser(shared_device(), task);
    recogniser.update(std::vector<Touch>(times, recording.touch(0)));
    return recogniser.estimate().identity[0];
  };
  const double once = told(1);
  EXPECT_GT(std::abs(told(9) - once), 1e-3) << "as in the paper, all touches multiply";
  task.by_place = true;
  EXPECT_NEAR(told(9), once, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(By, TouchPlacesOfARecogniser, each_filter, filter_name);

TEST(CandidateGrid, HasPlacesThatATenthOfTheBeliefTouches) {
  const RecognitionTask task(shapes(), HistogramOptions{});
  const std::vector<glm::dvec2> array = digitacts_array();
  for (const std::size_t elsewhere : {2U, 1U}) {  // of 15 samples: more and less than a tenth
    std::vector<PoseSample> samples(15);
    for (std::size_t i = 0; i < elsewhere; ++i) {
      samples[i].T_object_robot.translation_mm = {-100.0, 0.0};  // the object lies at x = 100 mm
    }
    const std::vector<Pose> candidates = candidate_grid(samples, task, array, 0.0);
    EXPECT_EQ(candidates.size() % 4, 0u) << "angles";
    const auto is_elsewhere = [&](const Pose& candidate) {
      return glm::length(candidate * array_centre_mm(array) - glm::dvec2(100.0, 0.0)) < 30.0;
    };
    EXPECT_EQ(std::ranges::any_of(candidates, is_elsewhere), elsewhere == 2) << elsewhere;
    EXPECT_FALSE(std::ranges::all_of(candidates, is_elsewhere));
  }
}

}  // namespace palpate::touch_places_test
