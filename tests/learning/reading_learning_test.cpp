#include "learning/reading_learning.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "simulated_presses.hpp"
#include "synthetic.hpp"

namespace palpate::reading_learning_test {

TEST(LevelEdges, PartContactsIntoEqualShares) {
  Recording recording;
  recording.T_robot_sensor = {Pose{}};
  for (int i = 0; i < 100; ++i) {
    recording.elements_mm.emplace_back(i, 0.0);
    recording.pressure.push_back(i < 40 ? 0.0 : 100.0 + i);
  }
  const std::vector<Press> presses{single_press(recording, 0)};
  const ContactClassifier classifier{.threshold = 2.0, .ratio = 0.1};
  EXPECT_EQ(level_edges_of(presses, classifier, 5), (std::vector<double>{155.0, 170.0, 185.0}));
  EXPECT_TRUE(level_edges_of(presses, classifier, 2).empty());
  for (double& pressure : recording.pressure) {
    pressure = pressure > 0.0 ? 50.0 : 0.0;
  }
  EXPECT_TRUE(level_edges_of(presses, classifier, 5).empty()) << "one pressure has one level";
}

TEST(Readings, OfNoiseAloneMakeNoContact) {
  // Otsu's threshold of 0.5 and 20 kPa is 3.2 kPa; untouched elements read -2 kPa more often.
  Recording recording;
  recording.T_robot_sensor = {Pose{}};
  recording.elements_mm = grid_array(20, 20, 2.0);
  for (std::size_t e = 0; e < recording.elements_mm.size(); ++e) {
    recording.pressure.push_back(e < 20 ? 20.0 : e % 4 == 0 ? 0.5 : -2.0);
  }
  const std::vector<Press> presses{single_press(recording, 0)};
  const LearnedReadings found = learn_readings(presses, {.spacing_mm = 2.0});
  EXPECT_NEAR(found.noise, std::sqrt((3.0 * 4.0 + 0.25) / 4.0), 0.01);
  EXPECT_EQ(found.classifier.threshold, 3.0 * found.noise);
  EXPECT_EQ(learn_readings(presses, {.threshold = 1.0, .spacing_mm = 2.0}).classifier.threshold,
            1.0)
      << "as given";
}

}  // namespace palpate::reading_learning_test
