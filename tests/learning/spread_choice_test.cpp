// The spread of maps that predicts left-out touches best.

#include <gtest/gtest.h>

#include "learning/spread_choice.hpp"
#include "palpate/simulation.hpp"

namespace palpate::spread_choice_test {

/// Touches of two letters by one array.
struct Touched {
  Touched(const std::vector<glm::dvec2>& elements_mm, double element_mm, double psf_mm,
          const std::vector<Pose>& poses) {
    for (const char* letter : {"A", "E"}) {
      const SensorModel sensor{.psf_mm = psf_mm, .element_mm = element_mm};
      Simulator simulator(make_shape(letter), sensor, elements_mm, 4);
      recordings.push_back(simulator.touch(poses, {}));
    }
    for (const Recording& recording : recordings) {
      objects.push_back({recording.object, recording.touches(0, recording.size())});
    }
  }

  SpreadChoice choice() const {
    MapOptions options;
    options.sensor.prior = 0.25;
    return choose_spread(objects, options);
  }

  std::vector<Recording> recordings;
  std::vector<ObjectTouches> objects;
};

TEST(SpreadChoice, KeepsTheDefaultOnTheLettersOfThePaper) {
  for (const std::vector<Pose>& poses : {training_grid(), random_poses(60, 7)}) {
    const SpreadChoice choice =
        Touched(digitacts_array(), digitacts_element_mm, 1.0, poses).choice();
    EXPECT_EQ(choice.spread_mm, 0.5) << poses.size() << " touches";
    EXPECT_EQ(choice.likelihood_gain, 0.0);
  }
}

TEST(SpreadChoice, IsNarrowerForAFineSharpArray) {
  const SpreadChoice choice =
      Touched(grid_array(16, 16, 1.0), 0.95, 0.3, random_poses(30, 7)).choice();
  EXPECT_LT(choice.spread_mm, 0.4);
  EXPECT_GT(choice.likelihood_gain, 0.1);
  EXPECT_GT(choice.place_gain_mm, 0.01);
}

TEST(SpreadChoice, IsWiderForElementsFarApartButNotHalfTheirDistance) {
  const SpreadChoice choice =
      Touched(grid_array(8, 8, 8.0), 7.6, 1.0, random_poses(40, 7)).choice();
  EXPECT_GT(choice.spread_mm, 0.6);
  EXPECT_LT(choice.spread_mm, 2.0);
}

TEST(SpreadChoice, OfFewTouchesIsTheDefault) {
  Touched touched(grid_array(8, 8, 8.0), 7.6, 1.0, random_poses(6, 7));
  EXPECT_EQ(touched.choice().spread_mm, 0.5);
  touched.objects.clear();
  EXPECT_EQ(touched.choice().spread_mm, 0.5);
}

}  // namespace palpate::spread_choice_test
