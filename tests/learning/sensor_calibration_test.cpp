#include "sensor_calibration.hpp"

#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "simulated_presses.hpp"

namespace palpate {
namespace {

SensorCalibrationOptions options() {
  return {.threshold = 2.0, .ratio = 0.3, .layer = MapLayer::log_odds, .levels = 2, .folds = 2};
}

TEST(SensorCalibration, LearnsWhatAFileHolds) {
  SimulatedPresses simulated;
  simulated.add_shapes(4, 31);
  const SensorCalibration found = calibrate_sensor(simulated.presses, {}, options());
  found.sensor.validate();
  EXPECT_EQ(found.objects, 2U);
  ASSERT_TRUE(found.after.has_value());
  EXPECT_EQ(found.after->records, 8U);
  EXPECT_NEAR(found.after->accuracy(), 1.0, 1e-9);
  EXPECT_LT(found.after->log_loss, 0.7) << "a guess's";
  EXPECT_EQ(found.sensor.table->objects.size(), 2U);
  EXPECT_TRUE(found.sensor.features.has_value());
  EXPECT_GE(found.sensor.familiarity->slope, 0.0);
  EXPECT_GT(*found.area_under_curve, 0.5);
  EXPECT_TRUE(found.warnings.empty());
}

TEST(SensorCalibration, OfOneObjectLearnsTheTableAlone) {
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 3, 32);
  const SensorCalibration found = calibrate_sensor(simulated.presses, {}, options());
  found.sensor.validate();
  EXPECT_TRUE(found.sensor.table.has_value());
  EXPECT_EQ(found.sensor.temperature, 1.0);
  EXPECT_FALSE(found.sensor.features.has_value());
  EXPECT_FALSE(found.sensor.familiarity.has_value());
  EXPECT_FALSE(found.before || found.table || found.after || found.area_under_curve);
  ASSERT_EQ(found.warnings.size(), 1U);
}

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

}  // namespace
}  // namespace palpate
