// Presses that say little: refused in words, or learned from as calibrate_sensor() documents.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "learning/sensor_calibration.hpp"
#include "palpate/error.hpp"
#include "simulated_presses.hpp"

namespace palpate::sensor_calibration_degenerate_test {

constexpr std::size_t elements = 36;

/// Touches of two letters.
LetterPresses two_letters(int touches = 16) {
  LetterPresses letters;
  letters.add("A", touches, 61);
  letters.add("U", touches, 62);
  return letters;
}

std::string refusal(const std::vector<Press>& presses,
                    const SensorCalibrationOptions& options = {}) {
  try {
    calibrate_sensor(presses, {}, options);
  } catch (const Error& error) {
    return error.what();
  }
  return "not refused";
}

/// The calibration; its numbers are sound and its confidence finite.
/// @param options of two folds: each fold learns again all that is learned
SensorCalibration learned(const std::vector<Press>& presses,
                          const SensorCalibrationOptions& options = {.folds = 2}) {
  SensorCalibration found = calibrate_sensor(presses, {}, options);
  found.sensor.validate();
  EXPECT_TRUE(found.sensor.table.has_value());
  for (const double nats : found.sensor.table->shared) {
    EXPECT_TRUE(std::isfinite(nats) && nats <= 0.0) << nats;
  }
  for (const auto& scores : {found.before, found.table, found.after}) {
    EXPECT_TRUE(!scores || std::isfinite(scores->log_loss));
  }
  return found;
}

bool warns(const SensorCalibration& found, const std::string& part) {
  return std::ranges::any_of(found.warnings, [&](const std::string& warning) {
    return warning.find(part) != std::string::npos;
  });
}

class DegeneratePresses : public testing::TestWithParam<bool> {};

TEST_P(DegeneratePresses, OneIsRefused) {
  LetterPresses letters;
  letters.add("A", 1, 63);
  letters.make_presses(GetParam());
  EXPECT_NE(refusal(letters.presses).find("at least two touches of one object"), std::string::npos)
      << refusal(letters.presses);
}

TEST_P(DegeneratePresses, OneOfEachObjectIsRefused) {
  LetterPresses letters = two_letters(1);
  letters.make_presses(GetParam());
  EXPECT_NE(refusal(letters.presses).find("none of 2 touches"), std::string::npos);
}

TEST_P(DegeneratePresses, OfOneObjectKeepTheDefaultConfidence) {
  LetterPresses letters;
  letters.add("A", 20, 64);
  letters.make_presses(GetParam());
  const SensorCalibration found = learned(letters.presses);
  EXPECT_EQ(found.objects, 1U);
  EXPECT_EQ(found.sensor.temperature, 1.0);
  EXPECT_FALSE(found.sensor.features || found.before);
  ASSERT_EQ(found.warnings.size(), 1U);
  EXPECT_TRUE(warns(found, "touches of one object say nothing about confidence"));
}

TEST_P(DegeneratePresses, AllUnknownAreRefused) {
  LetterPresses letters = two_letters();
  for (Recording& recording : letters.recordings) {
    recording.valid.assign(elements, 0);
  }
  letters.make_presses(GetParam());
  EXPECT_NE(refusal(letters.presses).find("no pressure is above 0"), std::string::npos);
  EXPECT_NE(refusal(letters.presses, {.threshold = 2.0, .ratio = 0.3}).find("no pressure is above"),
            std::string::npos);
}

TEST_P(DegeneratePresses, SomeUnknownAreLeftOut) {
  LetterPresses letters = two_letters();
  const SensorCalibration expected = [&] {
    LetterPresses without = letters;
    for (Recording& recording : without.recordings) {
      recording.pressure.resize(14 * elements);
      recording.T_robot_sensor.resize(14);
    }
    without.make_presses(GetParam());
    return learned(without.presses);
  }();
  for (Recording& recording : letters.recordings) {
    std::fill(recording.pressure.end() - 2 * elements, recording.pressure.end() - elements, 0.0);
    std::fill(recording.pressure.end() - elements, recording.pressure.end(),
              std::numeric_limits<double>::quiet_NaN());
  }
  letters.make_presses(GetParam());
  const SensorCalibration found = learned(letters.presses);
  EXPECT_TRUE(warns(found, "A.h5, touch 14: all elements are Unknown"));
  EXPECT_TRUE(warns(found, "with 3 more such touches"));
  EXPECT_EQ(found.sensor.table->shared, expected.sensor.table->shared);
  EXPECT_EQ(found.after->records, 28U);
}

TEST_P(DegeneratePresses, OfADeadElementIgnoreIt) {
  LetterPresses letters = two_letters();
  for (Recording& recording : letters.recordings) {
    recording.valid.assign(elements, 1);
    recording.valid[8] = 0;
  }
  letters.make_presses(GetParam());
  const SensorCalibration expected = learned(letters.presses);
  for (Recording& recording : letters.recordings) {
    for (std::size_t i = 8; i < recording.pressure.size(); i += elements) {
      recording.pressure[i] = i % 5 == 0 ? std::numeric_limits<double>::quiet_NaN() : 900.0;
    }
  }
  letters.make_presses(GetParam());
  const SensorCalibration found = learned(letters.presses);
  EXPECT_EQ(found.sensor.classifier.threshold, expected.sensor.classifier.threshold);
  EXPECT_EQ(found.sensor.noise, expected.sensor.noise);
  EXPECT_EQ(found.sensor.table->shared, expected.sensor.table->shared);
  ASSERT_EQ(found.sensor.features.has_value(), !GetParam()) << "at unknown poses only";
  ASSERT_EQ(expected.sensor.features.has_value(), !GetParam());
  if (found.sensor.features) {
    EXPECT_EQ(found.sensor.features->any.mean, expected.sensor.features->any.mean);
  }
  EXPECT_FALSE(warns(found, "stuck"));
}

TEST_P(DegeneratePresses, OfAStuckElementAreWarnedOf) {
  LetterPresses letters = two_letters();
  for (Recording& recording : letters.recordings) {
    for (std::size_t i = 8; i < recording.pressure.size(); i += elements) {
      recording.pressure[i] = 45.0;
    }
  }
  letters.make_presses(GetParam());
  const SensorCalibration found = learned(letters.presses);
  EXPECT_TRUE(warns(found, "element 8 reads the same pressure above the threshold in all 32"));
  EXPECT_TRUE(warns(found, "'valid' to 0"));
}

TEST_P(DegeneratePresses, OfAnObjectTouchedOnceAreWarnedOf) {
  LetterPresses letters = two_letters();
  letters.add("R", 1, 65);
  letters.make_presses(GetParam());
  const SensorCalibration found = learned(letters.presses);
  EXPECT_TRUE(warns(found, "'R': no touch has a map of the object"));
  EXPECT_FALSE(found.sensor.table->objects.contains("R"));
  EXPECT_EQ(found.after->records, 32U);
}

TEST_P(DegeneratePresses, OfOneObjectUnderTwoLabelsMakeNoneSure) {
  LetterPresses letters;
  letters.add("A", 18, 66);
  letters.add("A", 18, 67);
  letters.recordings[1].object = "B";
  letters.make_presses(GetParam());
  const SensorCalibration found = learned(letters.presses);
  EXPECT_EQ(found.objects, 2U);
  EXPECT_LT(found.after->accuracy(), 0.7);
  EXPECT_LT(found.after->log_loss, std::log(2.0) + 0.15) << "hardly worse than a guess";
}

TEST_P(DegeneratePresses, WithoutTheLevelsAskedForHaveFewer) {
  LetterPresses letters = two_letters();
  for (Recording& recording : letters.recordings) {
    for (double& pressure : recording.pressure) {
      pressure = pressure > 8.0 ? 20.0 : pressure > 4.0 ? 10.0 : 0.0;
    }
  }
  letters.make_presses(GetParam());
  const SensorCalibration found =
      learned(letters.presses,
              {.threshold = 2.0, .ratio = 0.3, .tables = {{MapLayer::mean_level, 7}}, .folds = 2});
  EXPECT_EQ(found.sensor.table->level_edges, (std::vector<double>{20.0}));
  const SensorCalibration two =
      learned(letters.presses,
              {.threshold = 15.0, .ratio = 0.3, .tables = {{MapLayer::mean_level, 8}}, .folds = 2});
  EXPECT_EQ(two.sensor.table->levels(), 2U) << "one pressure In Contact is one level";
}

INSTANTIATE_TEST_SUITE_P(AtPoses, DegeneratePresses, testing::Bool(),
                         [](const auto& test) { return test.param ? "Known" : "Unknown"; });

TEST(DegenerateCalibration, OfElementsThatAllChangeWarnsOfNone) {
  EXPECT_FALSE(warns(learned(two_letters().presses), "stuck"));
}

TEST(DegenerateCalibration, OfNoPressesOrPosesOfBothKindsIsRefused) {
  EXPECT_NE(refusal({}).find("no touches"), std::string::npos);
  LetterPresses letters = two_letters();
  letters.presses[3].T_object_robot.reset();
  EXPECT_NE(refusal(letters.presses).find("A.h5, touch 3: its pose is unknown"), std::string::npos);
}

TEST(DegenerateCalibration, OptionsOutOfRangeAreRefused) {
  const LetterPresses letters = two_letters();
  EXPECT_NE(refusal(letters.presses, {.threshold = 1000.0}).find("above the contact threshold"),
            std::string::npos);
  EXPECT_NE(refusal(letters.presses, {.ratio = 1.0}).find("ratio = 1"), std::string::npos);
}

TEST(DegenerateCalibration, OfAnArrayOfOneElementIsRefused) {
  Recording recording;
  recording.object = "A";
  recording.elements_mm = {{0.0, 0.0}};
  recording.T_robot_sensor = {Pose{}, {{1.0, 0.0}, 0.0}};
  recording.pressure = {1.0, 20.0};
  EXPECT_NE(
      refusal({posed_press(recording, 0), posed_press(recording, 1)}).find("one element each"),
      std::string::npos);
}

TEST(DegenerateCalibration, OnMapsOfOtherObjectsIsRefused) {
  const LetterPresses letters = two_letters();
  TrainingMap other = maps_by_folds(letters.presses, {}, 2).without_folds.front();
  other.map.label = "Z";
  try {
    calibrate_sensor(letters.presses, {other.map}, {});
    FAIL() << "a table of nothing was learned";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("or a map of it"), std::string::npos);
  }
}

}  // namespace palpate::sensor_calibration_degenerate_test
