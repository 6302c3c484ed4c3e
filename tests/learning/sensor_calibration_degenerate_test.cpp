// Presses that say little: refused in words, or learned from as calibrate_sensor() documents. What
// judges a fold has not seen it.

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "learning/sensor_calibration.hpp"
#include "simulated_presses.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::sensor_calibration_degenerate_test {

constexpr std::size_t elements = 36;

void expect_refused(const char* named, const std::vector<Press>& presses,
                    const CalibrationSettings& options = {}) {
  expect_named(input_error([&] { calibrate_sensor(presses, {}, options); }), {named});
}

/// Presses at known or unknown poses.
class DegeneratePresses : public testing::TestWithParam<bool> {
 protected:
  /// The calibration; its numbers are sound and its confidence finite.
  /// @param options of two folds: each fold learns again all that is learned
  SensorCalibration learned(LetterPresses letters,
                            const CalibrationSettings& options = {.folds = 2}) {
    letters.make_presses(GetParam());
    SensorCalibration found = calibrate_sensor(letters.presses, {}, options);
    found.sensor.validate();
    EXPECT_TRUE(found.sensor.table.has_value());
    for (const double nats : found.sensor.table->shared) {
      EXPECT_TRUE(std::isfinite(nats) && nats <= 0.0) << nats;
    }
    if (const auto& scores = found.touches) {
      EXPECT_TRUE(
          std::isfinite(scores->before.log_loss + scores->table.log_loss + scores->after.log_loss));
    }
    return found;
  }
};

TEST_P(DegeneratePresses, ThatSayNothingAreRefused) {
  LetterPresses one;
  one.add("A", 1, 63);
  one.make_presses(GetParam());
  expect_refused("at least two touches of one object", one.presses);
  LetterPresses one_each = two_letters(1, 1, 61);
  one_each.make_presses(GetParam());
  expect_refused("none of 2 touches", one_each.presses);
  LetterPresses unknown = two_letters(16, 16, 61);
  for (Recording& recording : unknown.recordings) {
    recording.valid.assign(elements, 0);
  }
  unknown.make_presses(GetParam());
  expect_refused("no pressure is above 0", unknown.presses);
  expect_refused("no pressure is above", unknown.presses,
                 {.readings = {.threshold = 2.0, .ratio = 0.3}});
}

TEST_P(DegeneratePresses, OfOneObjectMakeNoneSure) {
  LetterPresses letters;
  letters.add("A", 20, 64);
  const SensorCalibration found = learned(letters);
  EXPECT_EQ(found.objects, 1U);
  EXPECT_EQ(found.sensor.temperature, 1.0);
  EXPECT_FALSE(found.sensor.features || found.touches);
  ASSERT_EQ(found.warnings.size(), 1U);
  EXPECT_TRUE(warns(found, "touches of one object say nothing about confidence"));
  letters.add("A", 20, 67);
  letters.recordings[1].object = "B";
  EXPECT_LT(learned(letters).touches->after.log_loss, std::log(2.0) + 0.15)
      << "little over a guess";
}

TEST_P(DegeneratePresses, SomeUnknownAndOneOfItsObjectAreLeftOut) {
  LetterPresses letters = two_letters(16, 16, 61);
  letters.add("R", 1, 65);
  LetterPresses without = letters;
  for (std::size_t k = 0; k < 2; ++k) {
    without.recordings[k].pressure.resize(14 * elements);
    without.recordings[k].T_robot_sensor.resize(14);
    std::vector<double>& pressure = letters.recordings[k].pressure;
    std::fill(pressure.end() - 2 * elements, pressure.end() - elements, 0.0);
    std::fill(pressure.end() - elements, pressure.end(), nan);
  }
  const SensorCalibration found = learned(letters);
  EXPECT_TRUE(warns(found, "A.h5, touch 14: all elements are Unknown"));
  EXPECT_TRUE(warns(found, "with 3 more such touches"));
  EXPECT_EQ(found.sensor.table->shared, learned(without).sensor.table->shared);
  EXPECT_EQ(found.touches->after.records, 28U);
  EXPECT_TRUE(warns(found, "'R': no touch has a map of the object"));
  EXPECT_FALSE(found.sensor.table->objects.contains("R"));
}

TEST_P(DegeneratePresses, OfADeadElementIgnoreIt) {
  LetterPresses letters = two_letters(16, 16, 61);
  for (std::size_t k = 0; k < 2; ++k) {
    letters.recordings[k].valid.assign(elements, 1);
    letters.recordings[k].valid[8] = 0;
  }
  LetterPresses noisy = letters;
  for (std::size_t k = 0; k < 2; ++k) {
    for (std::size_t i = 8; i < 16 * elements; i += elements) {
      noisy.recordings[k].pressure[i] = i % 5 == 0 ? nan : 900.0;
    }
  }
  const SensorCalibration expected = learned(letters);
  const SensorCalibration found = learned(noisy);
  EXPECT_EQ(found.sensor.classifier.threshold, expected.sensor.classifier.threshold);
  EXPECT_EQ(found.sensor.noise, expected.sensor.noise);
  EXPECT_EQ(found.sensor.table->shared, expected.sensor.table->shared);
  ASSERT_EQ(found.sensor.features.has_value(), !GetParam()) << "at unknown poses only";
  ASSERT_EQ(expected.sensor.features.has_value(), !GetParam());
  if (found.sensor.features) {
    EXPECT_EQ(found.sensor.features->any.mean, expected.sensor.features->any.mean);
  }
}

TEST_P(DegeneratePresses, WithoutTheLevelsAskedForHaveFewer) {
  LetterPresses letters = two_letters(16, 16, 61);
  for (Recording& recording : letters.recordings) {
    for (double& pressure : recording.pressure) {
      pressure = pressure > 8.0 ? 20.0 : pressure > 4.0 ? 10.0 : 0.0;
    }
  }
  const auto table = [&](double threshold, std::size_t levels) {
    const LearnedSensor sensor =
        learned(letters, {.readings = {.threshold = threshold, .ratio = 0.3},
                          .tables = {{MapLayer::mean_level, levels}},
                          .folds = 2})
            .sensor;
    EXPECT_EQ(sensor.classifier.threshold, threshold);
    EXPECT_EQ(sensor.classifier.ratio, 0.3);
    return sensor.table.value();
  };
  EXPECT_EQ(table(2.0, 7).level_edges, (std::vector<double>{20.0}));
  EXPECT_EQ(table(15.0, 8).levels(), 2U) << "one pressure In Contact is one level";
}

INSTANTIATE_TEST_SUITE_P(AtPoses, DegeneratePresses, testing::Bool(),
                         [](const auto& test) { return test.param ? "Known" : "Unknown"; });

TEST(DegenerateCalibration, IsRefusedByWhatIsWrong) {
  const LetterPresses letters = two_letters(16, 16, 61);
  expect_refused("no touches", {});
  expect_refused("above the contact threshold", letters.presses,
                 {.readings = {.threshold = 1000.0}});
  expect_refused("ratio = 1", letters.presses, {.readings = {.ratio = 1.0}});
  Recording one_element;
  one_element.object = "A";
  one_element.elements_mm = {{0.0, 0.0}};
  one_element.T_robot_sensor = {Pose{}, {{1.0, 0.0}, 0.0}};
  one_element.pressure = {1.0, 20.0};
  expect_refused("one element each", posed_presses(one_element));
  TrainingMap other = maps_by_folds(letters.presses, {}, 2).without_folds.front();
  other.map.label = "Z";
  expect_named(input_error([&] { calibrate_sensor(letters.presses, {other.map}, {}); }),
               {"or a map of it"});
  const auto beyond = [&](const Axis& x_mm, bool auto_pivot) {
    return CalibrationSettings{
        .bins = RecognitionBins{.lattice = {.x_mm = x_mm}, .auto_pivot = auto_pivot}};
  };
  expect_refused("beyond the bins' -5:5", letters.presses, beyond({-5.0, 5.0, 10}, true));
  expect_refused("too long", letters.presses, beyond({-1e5, 1e5, 2'000'000'000}, false));
}

class HeldOutCalibration : public testing::TestWithParam<bool> {};

TEST_P(HeldOutCalibration, JudgesAFoldByWhatTheOtherFoldsSayAlone) {
  const bool known_poses = GetParam();
  constexpr std::size_t touches = 15;
  constexpr std::size_t judged = 2;  // the fold
  LetterPresses letters = two_letters(touches, touches, 61);
  letters.make_presses(known_poses);
  const std::vector<std::size_t> fold = folds_of(letters.presses, 5);
  const CalibrationSettings settings{
      .readings = {.spacing_mm = 1.9},
      .tables = {{MapLayer::mean_level, 4}},
      .steps = known_poses ? std::optional(BinSteps{1.0, 1.0, 0.5}) : std::nullopt};
  const auto model = [&] {
    letters.make_presses(known_poses);
    const std::vector<Press> others = presses_without(judged, letters.presses, settings.folds);
    return models_of(others, settings).front();
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
  const auto learned = [](const FoldModel& of) {
    const ContactModel& contact = of.learning.contact;
    const auto mean = of.features ? std::optional(of.features->any.mean) : std::nullopt;
    return std::tuple(contact.classifier.threshold, contact.classifier.ratio, contact.prior,
                      of.learning.level_edges, of.learning.layer.full_level,
                      of.maps[0].map.log_odds, of.table->shared, mean);
  };
  EXPECT_EQ(learned(same), learned(before));
  EXPECT_NE(std::get<0>(learned(other)), std::get<0>(learned(before)));
  EXPECT_NE(std::get<1>(learned(other)), std::get<1>(learned(before)));
  EXPECT_NE(other.learning.level_edges, before.learning.level_edges);
  EXPECT_EQ(before.learning.layer.near_mm, 2.0 * settings.readings.spacing_mm);
  EXPECT_EQ(before.learning.layer.far_mm, 6.0 * settings.readings.spacing_mm);
  ASSERT_EQ(same.features.has_value(), !known_poses);
  if (!known_poses) {
    EXPECT_NE(other.features->any.mean, before.features->any.mean);
  }
}

INSTANTIATE_TEST_SUITE_P(AtPoses, HeldOutCalibration, testing::Bool(),
                         [](const auto& test) { return test.param ? "Known" : "Unknown"; });

}  // namespace palpate::sensor_calibration_degenerate_test
