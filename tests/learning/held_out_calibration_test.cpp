// What judges a calibration has not seen what it judges: a press is judged alike whatever the
// others of its fold are.

#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "learning/sensor_calibration.hpp"
#include "simulated_presses.hpp"

namespace palpate::held_out_calibration_test {

class HeldOutCalibration : public testing::TestWithParam<bool> {};

TEST_P(HeldOutCalibration, JudgesAFoldByWhatTheOtherFoldsSayAlone) {
  const bool known_poses = GetParam();
  constexpr std::size_t touches = 15;
  constexpr std::size_t elements = 36;
  constexpr std::size_t judged = 2;  // the fold
  LetterPresses letters;
  letters.add("A", touches, 61);
  letters.add("U", touches, 62);
  letters.make_presses(known_poses);
  const std::vector<std::size_t> fold = folds_of(letters.presses, 5);
  const ModelLearning how{
      .readings = {.spacing_mm = 1.9},
      .bins = known_poses ? std::optional(BinSteps{1.0, 1.0, 0.5}) : std::nullopt};
  const auto model = [&] {
    letters.make_presses(known_poses);
    const std::vector<Press> others = presses_without(judged, letters.presses, how.folds);
    return models_of(others, {{MapLayer::mean_level, 4}}, how).front();
  };
  const auto press_harder = [&](bool judged_ones) {
    for (std::size_t i = 0; i < fold.size(); ++i) {
      double* const pressure =
          letters.recordings[i / touches].pressure.data() + (i % touches) * elements;
      for (std::size_t e = 0; e < elements && (fold[i] == judged) == judged_ones; ++e) {
        pressure[e] = 3.0 + 2.0 * pressure[e] * pressure[e];
      }
    }
  };
  const FoldModel before = model();
  press_harder(true);
  const FoldModel same = model();
  press_harder(false);
  const FoldModel other = model();
  EXPECT_EQ(same.how.contact.classifier.threshold, before.how.contact.classifier.threshold);
  EXPECT_NE(other.how.contact.classifier.threshold, before.how.contact.classifier.threshold);
  EXPECT_EQ(same.how.contact.classifier.ratio, before.how.contact.classifier.ratio);
  EXPECT_NE(other.how.contact.classifier.ratio, before.how.contact.classifier.ratio);
  EXPECT_EQ(same.how.contact.prior, before.how.contact.prior);
  EXPECT_EQ(same.how.level_edges, before.how.level_edges);
  EXPECT_NE(other.how.level_edges, before.how.level_edges);
  EXPECT_EQ(before.how.layer.near_mm, 2.0 * how.readings.spacing_mm);
  EXPECT_EQ(before.how.layer.far_mm, 6.0 * how.readings.spacing_mm);
  EXPECT_EQ(same.how.layer.full_level, before.how.layer.full_level);
  EXPECT_EQ(same.maps[0].map.log_odds, before.maps[0].map.log_odds);
  EXPECT_EQ(same.table->shared, before.table->shared);
  ASSERT_EQ(same.features.has_value(), !known_poses);
  if (!known_poses) {
    EXPECT_EQ(same.features->any.mean, before.features->any.mean);
    EXPECT_NE(other.features->any.mean, before.features->any.mean);
  }
}

INSTANTIATE_TEST_SUITE_P(AtPoses, HeldOutCalibration, testing::Bool(),
                         [](const auto& test) { return test.param ? "Known" : "Unknown"; });

}  // namespace palpate::held_out_calibration_test
