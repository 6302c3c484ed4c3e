#include "learning/sensor_calibration.hpp"

#include <numbers>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "simulated_presses.hpp"

namespace palpate::sensor_calibration_test {

/// Bins over +-10 mm and the full circle.
RecognitionBins bins(int nx, int ny, int ntheta) {
  return {.lattice = {.x_mm = {-10.0, 10.0, nx},
                      .y_mm = {-10.0, 10.0, ny},
                      .theta_rad = {0.0, 2.0 * std::numbers::pi, ntheta}},
          .auto_pivot = false};
}

/// What a calibration of letters has to have, at poses that are known or not.
void expect_complete(const SensorCalibration& found, std::size_t touches) {
  found.sensor.validate();
  EXPECT_EQ(found.objects, 3U);
  EXPECT_NEAR(found.sensor.classifier.threshold, 2.0, 0.7);
  EXPECT_NEAR(found.sensor.noise, 0.7, 0.07);
  for (const char* letter : {"A", "R", "U"}) {
    EXPECT_TRUE(found.sensor.table->objects.contains(letter)) << letter;
  }
  const ComparedScores& scores = found.touches.value();
  for (const Scores& of_model : {scores.before, scores.table, scores.after}) {
    EXPECT_EQ(of_model.records, touches);
  }
  EXPECT_LE(scores.after.log_loss, scores.table.log_loss);
  EXPECT_LE(scores.after.calibration_error, 0.1);
  EXPECT_GT(found.sensor.temperature, 1.0) << "elements are not independent";
  EXPECT_TRUE(found.sensor.fit_scale->stranger_single_touch.has_value());
  EXPECT_TRUE(found.warnings.empty());
}

/// Every `stride`-th touch of the training grid on three letters, in the grid's order or, by a
/// `step` that shares no factor with the grid's size, all over the grid.
LetterPresses three_letters(std::size_t stride, std::size_t step = 1) {
  std::vector<Pose> poses;
  const std::vector<Pose> grid = training_grid();
  for (std::size_t i = 0; i < grid.size(); i += stride) {
    poses.push_back(grid[i * step % grid.size()]);
  }
  LetterPresses letters;
  letters.add("A", poses, 35);
  letters.add("R", poses, 36);
  letters.add("U", poses, 37);
  return letters;
}

TEST(SensorCalibration, OfLettersAtKnownPosesLearnsTheirSensor) {
  const LetterPresses letters = three_letters(3, 5);
  double shown = 0.0;
  const SensorCalibration found = calibrate_sensor(letters.presses, {}, {}, [&](double fraction) {
    EXPECT_GE(fraction, shown);
    shown = fraction;
  });
  EXPECT_NEAR(shown, 1.0, 1e-9);
  expect_complete(found, 192);
  EXPECT_FALSE(found.sensor.features.has_value()) << "they tell where a touch was";
  ASSERT_TRUE(found.groups.has_value());
  EXPECT_GT(found.groups->after.interval().low, found.touches->after.interval().high);
  ASSERT_TRUE(found.sensor.bins.has_value());
  EXPECT_NEAR(found.sensor.bins->x_mm, 0.95, 1e-9);
  EXPECT_NEAR(found.sensor.bins->theta_rad, std::numbers::pi / 36.0, 1e-9);
  EXPECT_EQ(default_tables(true).size(), 1U);
  EXPECT_EQ(found.sensor.table->levels(), 7U);
  EXPECT_EQ(found.sensor.table->layer.of, MapLayer::mean_level);
  // One touch, smaller than a letter, tells it better than chance.
  EXPECT_GT(found.touches->after.interval().low, 0.5);
  // Elements of the simulator are nearly independent. Bins an element apart would blame the table
  // for poses between them.
  EXPECT_LT(found.sensor.temperature, 2.5);
  EXPECT_EQ(found.sensor.spread_mm, 0.5);
  // Three touches of a letter fit the other two as badly as those of other strangers.
  EXPECT_NEAR(found.sensor.fit_scale->stranger_sd.value(), 4.0, 2.0);
  ASSERT_TRUE(found.sensor.fit_scale->single_touch);
  EXPECT_GT(found.sensor.fit_scale->single_touch->mean, found.sensor.fit_scale->mean + 0.1);
  EXPECT_LT(found.sensor.fit_scale->single_touch->sd, 0.95 * found.sensor.fit_scale->sd);
}

TEST(SensorCalibration, OfLettersAtUnknownPosesIsComplete) {
  LetterPresses letters = three_letters(10, 5);
  letters.make_presses(false);
  const SensorCalibration found = calibrate_sensor(letters.presses, {}, {});
  expect_complete(found, 60);
  EXPECT_EQ(default_tables(false).size(), 2U);
  EXPECT_EQ(default_tables(false)[0].layer, MapLayer::log_odds);
  EXPECT_TRUE(found.sensor.features->objects.contains("R"));
  EXPECT_FALSE(found.groups || found.sensor.bins || found.sensor.fit_scale->stranger_sd ||
               found.sensor.fit_scale->single_touch);
  EXPECT_EQ(found.sensor.temperature_growth, 0.0);
  EXPECT_NEAR(found.sensor.spread_mm, 0.6 * 1.9, 0.1) << "of the spacing";
}

TEST(SensorCalibration, OnWideBinsIsLessSureTheMoreTouchesThereAre) {
  const LetterPresses letters = three_letters(4, 5);
  const SensorCalibration found =
      calibrate_sensor(letters.presses, {}, {.folds = 2, .bins = bins(13, 13, 12)});
  EXPECT_NEAR(found.sensor.bins->x_mm, 20.0 / 13.0, 1e-9);
  EXPECT_NEAR(found.sensor.bins->theta_rad, std::numbers::pi / 6.0, 1e-9);
  // Three touches share the distance to the nearest bin.
  EXPECT_GT(found.sensor.temperature_growth, 0.1);
  EXPECT_GT(found.groups->table.log_loss, found.groups->after.log_loss);
  EXPECT_LT(found.groups->after.calibration_error, found.groups->table.calibration_error);
}

TEST(SensorCalibration, OfFewTouchesLearnsTheSameGammaWhateverTheBinsAndMissesGroups) {
  const LetterPresses letters = three_letters(24);
  const auto gamma = [&](const std::optional<RecognitionBins>& given) {
    double shown = 0.0;
    const SensorCalibration found =
        calibrate_sensor(letters.presses, {}, {.folds = 9, .bins = given},
                         [&](double fraction) { shown = fraction; });
    EXPECT_NEAR(shown, 1.0, 1e-9) << "though no touch is of the last fold";
    EXPECT_FALSE(found.groups.has_value());
    EXPECT_EQ(found.sensor.temperature_growth, 0.0);
    EXPECT_TRUE(warns(found, "give 27 or more of each object"));
    return found.sensor.gamma;
  };
  EXPECT_EQ(gamma({}), gamma(bins(3, 4, 5)));
}

TEST(SensorCalibration, ComparesWithTheMapsGiven) {
  const LetterPresses letters = three_letters(12);
  std::vector<OccupancyGrid> maps;
  for (const TrainingMap& map : maps_by_folds(letters.presses, {}, 2).without_folds) {
    if (map.map.label != "U") {
      maps.push_back(map.map);
    }
  }
  const SensorCalibration found =
      calibrate_sensor(letters.presses, maps, {.folds = 2, .bins = bins(13, 13, 12)});
  EXPECT_EQ(found.objects, 2U);
  EXPECT_EQ(found.touches->after.records, 32U);
  ASSERT_EQ(found.warnings.size(), 1U);
  EXPECT_TRUE(warns(found, "'U'"));
}

TEST(SensorCalibration, KeepsTheFirstTableUnlessAnotherIsBetterBeyondChance) {
  const LetterPresses letters = three_letters(14);
  const SensorCalibration found =
      calibrate_sensor(letters.presses, {},
                       {.tables = {{MapLayer::mean_level, 4}, {MapLayer::mean_level, 5}},
                        .folds = 2,
                        .bins = bins(13, 13, 12)});
  ASSERT_EQ(found.tried.size(), 2U);
  EXPECT_GT(found.tried[0].log_loss, found.tried[1].log_loss) << "by chance";
  EXPECT_EQ(found.sensor.table->levels(), 4U);
  EXPECT_EQ(found.touches->after.log_loss, found.tried[0].log_loss);
}

}  // namespace palpate::sensor_calibration_test
