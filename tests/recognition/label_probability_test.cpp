// Temperature and press features, with numbers that were worked out by hand.

#include "recognition/label_probability.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "palpate/error.hpp"
#include "recognition/filter_choice.hpp"
#include "recognition/misfit.hpp"
#include "recognition/recognition_record.hpp"
#include "shapes.hpp"

namespace palpate::label_probability_test {

/// Maps of L, disc and L again.
RecognitionTask three_maps(const FilterOptions& filter = HistogramOptions{}) {
  std::vector<Hypothesis> maps = shapes();
  maps.push_back(maps[0]);
  return {maps, filter};
}

/// Evidence of 3 and 1 of the maps of L, of 1 of the disc.
Estimate four_to_one() {
  return {.identity = {0.6, 0.2, 0.2}, .log_evidence = {std::log(3.0), 0.0, 0.0}};
}

/// A press of two elements in contact of three, with features log 3, log 8 and log 6.
class Press {
 public:
  Touch touch() const {
    return {.T_robot_sensor = {}, .elements_mm = elements_mm_, .pressure = pressure_};
  }
  static constexpr std::array<double, 3> of_one{3.0, 8.0, 6.0};

 private:
  std::vector<glm::dvec2> elements_mm_ = std::vector<glm::dvec2>(3);
  std::vector<double> pressure_{10.0, 0.0, 4.0};
};

/// Any object's features are about 0, and the letter's about those of the press.
LearnedFeatures features_of_the_letter() {
  FeatureDistribution any{.mean = {0.0, 0.0, 0.0}, .sd = {1.0, 1.0, 1.0}};
  FeatureDistribution letter = any;
  for (std::size_t i = 0; i < 3; ++i) {
    letter.mean[i] = std::log(Press::of_one[i]);
  }
  return {.weight = 0.5, .any = any, .objects = {{"L", letter}}};
}

/// What one press says for the letter: half of half the squared distance to any object's mean.
double nats_of_one_press() {
  double squares = 0.0;
  for (const double one : Press::of_one) {
    squares += std::log(one) * std::log(one);
  }
  return 0.5 * 0.5 * squares;
}

TEST(LabelProbability, IsTheSumOfTheMapsAtTemperatureOne) {
  EXPECT_EQ(judge(four_to_one(), {}, three_maps()).identity, (std::vector<double>{0.8, 0.2}));
}

TEST(LabelProbability, IsTheRootOfTheEvidenceAtTemperatureTwo) {
  RecognitionTask task = three_maps();
  task.sensor.temperature = 2.0;
  const RecognitionStep step = judge(four_to_one(), {}, task);
  // Evidence 4 and 1.
  EXPECT_NEAR(step.identity[0], 2.0 / 3.0, 1e-15);
  EXPECT_NEAR(step.identity[1], 1.0 / 3.0, 1e-15);
  EXPECT_EQ(step.best, 0u);
}

TEST(LabelProbability, IsTemperedMoreWithEveryTouch) {
  RecognitionTask task = three_maps();
  task.sensor.temperature = 1.0;
  task.sensor.temperature_growth = 0.5;
  const Press press;
  for (const std::size_t touches : {1U, 2U, 3U}) {
    const std::vector<Touch> all(touches, press.touch());
    const double times = std::pow(4.0, 1.0 / (0.5 + 0.5 * static_cast<double>(touches)));
    const RecognitionStep step = judge(four_to_one(), {}, task, evidence_of(all, task.contact()));
    EXPECT_NEAR(step.identity[0], times / (times + 1.0), 1e-15) << touches;
  }
}

TEST(LabelProbability, IsNotTemperedByTouchesThatTellNothing) {
  RecognitionTask task = three_maps();
  task.sensor.temperature_growth = 0.5;
  const Press press;
  std::vector<TouchEvidence> touches = evidence_of(std::vector(1, press.touch()), task.contact());
  const RecognitionStep one = judge(four_to_one(), {}, task, touches);
  TouchEvidence silent = touches.front();
  silent.readings.assign(silent.readings.size(), Reading::unknown);
  silent.contacts = 0;
  touches.insert(touches.begin(), silent);
  const RecognitionStep two = judge(four_to_one(), {}, task, touches);
  EXPECT_EQ(two.identity, one.identity);
}

TEST(LabelProbability, TempersNoneOfTheseToo) {
  RecognitionTask task = three_maps(HistogramOptions{.none_weight = 1.0});
  task.sensor.temperature = 2.0;
  Estimate estimate = four_to_one();
  estimate.none_log_evidence = std::log(9.0);
  const RecognitionStep step = judge(estimate, {}, task);
  EXPECT_NEAR(step.identity[0], 2.0 / 6.0, 1e-15);
  EXPECT_NEAR(step.identity[1], 1.0 / 6.0, 1e-15);
  EXPECT_NEAR(step.identity[2], 3.0 / 6.0, 1e-15);
  EXPECT_EQ(task.labels[step.best], none_label);
}

TEST(LabelProbability, ReachesEvidenceBelowEveryNumber) {
  RecognitionTask task = three_maps();
  task.sensor.temperature = 1000.0;
  const Estimate estimate{.identity = {1.0, 0.0, 0.0}, .log_evidence = {0.0, -2000.0, -9000.0}};
  const RecognitionStep step = judge(estimate, {}, task);
  EXPECT_NEAR(step.identity[1] / step.identity[0], std::exp(-2.0), 1e-14);
}

TEST(LabelProbability, AddsWhatEveryPressSaysAfterTheTemperature) {
  RecognitionTask task = three_maps(HistogramOptions{.none_weight = 1.0});
  task.sensor.temperature = 2.0;
  task.sensor.features = features_of_the_letter();
  Estimate estimate = four_to_one();
  estimate.none_log_evidence = 0.0;
  const Press press;
  const std::vector<Touch> two{press.touch(), press.touch()};
  const RecognitionStep step = judge(estimate, {}, task, evidence_of(two, task.contact()));
  const double of_letter = 2.0 * std::exp(2.0 * nats_of_one_press());
  EXPECT_NEAR(step.identity[0], of_letter / (of_letter + 1.0 + 1.0), 1e-14);
  EXPECT_NEAR(step.identity[1], 1.0 / (of_letter + 1.0 + 1.0), 1e-14) << "as any object";
  EXPECT_NEAR(step.identity[2], step.identity[1], 1e-15) << "as any object";
}

TEST(LabelProbability, MayTurnTheMostProbableLabelAround) {
  RecognitionTask task = three_maps();
  task.sensor.features = features_of_the_letter();
  const Estimate estimate{.identity = {0.1, 0.9, 0.0},
                          .log_evidence = {std::log(0.1), std::log(0.9), -1e9}};
  const Press press;
  const std::vector<Touch> touches{press.touch()};
  const RecognitionStep step =
      judge(estimate, {.label = "L"}, task, evidence_of(touches, task.contact()));
  ASSERT_GT(std::exp(nats_of_one_press()), 9.0 / 2.0);
  const double odds = std::exp(nats_of_one_press()) / 9.0;
  EXPECT_NEAR(step.identity[0] / step.identity[1], odds, 1e-14);
  EXPECT_EQ(step.best, odds > 1.0 ? 0u : 1u);
}

TEST(LabelProbability, PassesOverTouchesWithoutContact) {
  RecognitionTask task = three_maps();
  task.sensor.features = features_of_the_letter();
  const std::vector<glm::dvec2> elements_mm(2);
  const std::vector<double> pressure{0.0, 0.5};
  const Touch touch{.T_robot_sensor = {}, .elements_mm = elements_mm, .pressure = pressure};
  EXPECT_EQ(feature_nats(evidence_of(std::span(&touch, 1), task.contact()), task),
            std::vector<double>(2));
}

TEST(LabelBounds, FollowTheTemperatureAndTheFeatures) {
  RecognitionTask task = three_maps(BoundedOptions{});
  task.sensor.temperature = 2.0;
  Estimate estimate = four_to_one();
  // Evidence of L within 4 to 9, of the disc within 1 to 4.
  estimate.certificate = Certificate{
      .log_evidence = {{std::log(3.0), std::log(8.0)}, {0.0, std::log(4.0)}, {0.0, 0.0}}};
  const RecognitionStep step = judge(estimate, {}, task);
  ASSERT_EQ(step.identity_bounds.size(), 2u);
  EXPECT_NEAR(step.identity_bounds[0].low, 2.0 / (2.0 + 2.0), 1e-15);
  EXPECT_NEAR(step.identity_bounds[0].high, 3.0 / (3.0 + 1.0), 1e-15);
  EXPECT_NEAR(step.identity_bounds[1].low, 1.0 / (1.0 + 3.0), 1e-15);
  EXPECT_NEAR(step.identity_bounds[1].high, 2.0 / (2.0 + 2.0), 1e-15);

  task.sensor.features = features_of_the_letter();
  const Press press;
  const std::vector<Touch> touches{press.touch()};
  const RecognitionStep with = judge(estimate, {}, task, evidence_of(touches, task.contact()));
  const double times = std::exp(nats_of_one_press());
  EXPECT_NEAR(with.identity_bounds[0].low, 2.0 * times / (2.0 * times + 2.0), 1e-14);
  EXPECT_NEAR(with.identity_bounds[1].high, 2.0 / (2.0 + 2.0 * times), 1e-14);
}

TEST(Evidence, IsWhatBoundsFindWhereATemperatureNeedsIt) {
  const auto bounds = [](const LearnedSensor& sensor, const BoundedOptions& options = {}) {
    return std::get<BoundedOptions>(with_evidence(options, sensor));
  };
  LearnedSensor sensor;
  EXPECT_FALSE(bounds(sensor).evidence_nats) << "at temperature 1";
  EXPECT_FALSE(bounds(sensor).poor_bins) << "without a table";
  sensor.temperature = 30.0;
  EXPECT_EQ(bounds(sensor).evidence_nats, 0.05 * 30.0);
  EXPECT_EQ(bounds(sensor).evidence_growth, 0.0);
  EXPECT_EQ(bounds(sensor, {.evidence_nats = 0.1}).evidence_nats, 0.1);
  EXPECT_EQ(bounds(sensor, {.evidence_nats = 2.0}).evidence_nats, 1.5) << "it only tightens";
  EXPECT_TRUE(std::holds_alternative<HistogramOptions>(with_evidence(HistogramOptions{}, sensor)));
  sensor.temperature = 0.8;
  sensor.temperature_growth = 0.2;
  EXPECT_EQ(bounds(sensor).evidence_nats, 0.05 * 0.8);
  EXPECT_EQ(bounds(sensor).evidence_growth, 0.25);
  EXPECT_EQ(bounds({.features = features_of_the_letter()}).evidence_nats, 0.05);
}

/// What is told of the filter's bins where the sensor model was learned on others.
std::string wider_bins(const FilterOptions& filter, const std::optional<BinSteps>& learned) {
  RecognitionTask task = three_maps(filter);
  task.sensor.bins = learned;
  return wider_bins_sentence(task);
}

TEST(WiderBins, AreToldOfWhereTheSensorModelWasLearnedOnNarrowerOnes) {
  BoundedOptions bounds{.lattice = {.x_mm = {-10.0, 10.0, 20},
                                    .y_mm = {-10.0, 10.0, 20},
                                    .theta_rad = {0.0, 2.0, 20}}};
  EXPECT_EQ(wider_bins(bounds, {}), "") << "nothing is known of the sensor model's";
  EXPECT_EQ(wider_bins(bounds, BinSteps{0.7, 0.7, 0.07}), "") << "by less than a half";
  for (const BinSteps& steps :
       {BinSteps{0.6, 1.0, 0.1}, BinSteps{1.0, 0.6, 0.1}, BinSteps{1.0, 1.0, 0.06}}) {
    EXPECT_NE(wider_bins(bounds, steps).find("too sure"), std::string::npos);
  }
  EXPECT_NE(wider_bins(bounds, BinSteps{1.0, 1.0, 0.0}), "") << "learned at a fixed angle";
  bounds.lattice.theta_rad = {0.0, 6.0, 1};
  EXPECT_NE(wider_bins(bounds, BinSteps{1.0, 1.0, 0.5}), "") << "one bin is as wide as the region";
  bounds.lattice.theta_rad = {1.0, 1.0, 1};
  EXPECT_EQ(wider_bins(bounds, BinSteps{1.0, 1.0, 0.06}), "") << "a fixed angle has no bins";
  EXPECT_EQ(wider_bins(ParticleOptions{}, BinSteps{0.6, 0.6, 0.0}), "") << "particles have none";
}

TEST(Misfit, CountsForNoneAloneWhereTheScaleWasLearned) {
  HistogramOptions with_none;
  with_none.none_weight = 0.2;
  RecognitionTask task = three_maps(with_none);
  const Press press;
  const std::vector<TouchEvidence> touches(3, TouchEvidence(press.touch(), task.contact()));
  const Fit fit{.z = -8.0};
  EXPECT_EQ(tempering_of(touches, task, fit).features.back(), 0.0);
  task.sensor.fit_scale = FitScale{.mean = 0.1, .sd = 0.9, .shared_sd = 0.1};
  const std::vector<double> nats = tempering_of(touches, task, fit).features;
  EXPECT_EQ(nats.back(), misfit_nats(fit, 3, {.stranger_sd = usual_stranger_sd}));
  EXPECT_EQ(nats.front(), 0.0);
}

TEST(Misfit, IsByHowBadlyStrangersFitTheObjectsOfTheSensorModel) {
  RecognitionTask task = three_maps(HistogramOptions{.none_weight = 0.2});
  const Press press;
  const std::vector<TouchEvidence> touches(3, TouchEvidence(press.touch(), task.contact()));
  Estimate estimate = four_to_one();
  estimate.none_log_evidence = 0.0;
  const auto none = [&](const Fit& fit, std::optional<double> stranger_sd) {
    task.sensor.fit_scale =
        FitScale{.mean = 0.1, .sd = 0.9, .shared_sd = 0.1, .stranger_sd = stranger_sd};
    return label_probabilities(estimate, tempering_of(touches, task, fit), task).back();
  };
  // Where strangers fit hardly worse than learned objects, a fair fit may be one's, and a bad one
  // is neither's.
  EXPECT_GT(none({.z = -2.0}, 1.0), none({.z = -2.0}, {}));
  EXPECT_LT(none({.z = -16.0}, 1.0), none({.z = -16.0}, {}));
  EXPECT_EQ(none({.z = -2.0}, usual_stranger_sd), none({.z = -2.0}, {}));
}

}  // namespace palpate::label_probability_test
