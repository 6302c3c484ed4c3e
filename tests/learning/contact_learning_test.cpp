#include "learning/contact_learning.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "learning/table_learning.hpp"
#include "simulated_presses.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::contact_learning_test {

/// Touches [touch][element] of one row of elements, 1 mm apart, as a press.
struct RowPress {
  explicit RowPress(const std::vector<std::vector<double>>& pressures,
                    std::vector<std::uint8_t> valid = {}) {
    recording.elements_mm = grid_array(static_cast<int>(pressures.front().size()), 1, 1.0);
    for (const std::vector<double>& touch : pressures) {
      recording.T_robot_sensor.emplace_back();
      recording.pressure.insert(recording.pressure.end(), touch.begin(), touch.end());
    }
    recording.valid = std::move(valid);
    presses.push_back({.name = "row", .label = "L", .touches = all_touches(recording)});
  }

  Recording recording;
  std::vector<Press> presses;
};

double threshold_of(const std::vector<double>& pressures, std::vector<std::uint8_t> valid = {}) {
  return learn_classifier(RowPress({pressures}, std::move(valid)).presses).threshold;
}

std::vector<double> exps(std::vector<double> logs) {
  for (double& x : logs) {
    x = std::exp(x);
  }
  return logs;
}

TEST(ContactClassifierOfPresses, PartsByOtsuOverLogarithms) {
  // n1 n2 (m1 - m2)^2 is 3 * 1 * 8^2 = 192 where the gap to 9 is, 100 and 48 at the others.
  std::vector<double> pressures = exps({0.0, 1.0, 2.0, 9.0});
  EXPECT_NEAR(threshold_of(pressures), std::exp(5.5), 1e-9);
  // What is no reading is left out.
  pressures.insert(pressures.end(), {1e9, nan, -5.0, 0.0});
  EXPECT_NEAR(threshold_of(pressures, {1, 1, 1, 1, 0, 1, 1, 1}), std::exp(5.5), 1e-9);
  // Not always at the largest gap: 1 * 10 * 5.5^2 = 302.5 below 4, 6 * 5 * (11 / 3)^2 = 403 above.
  EXPECT_NEAR(threshold_of(exps({0.0, 4.0, 4.0, 4.0, 4.0, 4.0, 7.0, 7.0, 7.0, 7.0, 7.0})),
              std::exp(5.5), 1e-9);
}

TEST(ContactClassifierOfPresses, LearnsTheRatioFromSharesOfThePeak) {
  // T lies in the middle between 0 and 8. The logs of the shares are -10, -10, -2, 0 and -9, -9, 0,
  // 0.
  const RowPress row({exps({0.0, 0.0, 10.0, 8.0}), exps({0.0, 0.0, 9.0, 9.0})});
  const ContactClassifier found = learn_classifier(row.presses);
  EXPECT_NEAR(found.threshold, std::exp(4.0), 1e-9);
  EXPECT_NEAR(found.ratio, std::exp(-5.5), 1e-12);
  // At a given threshold, only touches that exceed it count: -10, -10, -2 and 0.
  const ContactClassifier given = learn_classifier(row.presses, std::exp(9.5));
  EXPECT_EQ(given.threshold, std::exp(9.5));
  EXPECT_NEAR(given.ratio, std::exp(-6.0), 1e-12);
  EXPECT_EQ(learn_classifier(row.presses, 1e9).ratio, ContactClassifier{}.ratio);
  EXPECT_EQ(learn_classifier(RowPress({exps({5.0, 5.0})}).presses, 1.0).ratio,
            ContactClassifier{}.ratio)
      << "all shares are 1";
}

TEST(ContactClassifierOfPresses, RefusesPressuresThatTellNothing) {
  expect_named(input_error([] {
                 threshold_of({7.0, 7.0, 0.0});
               }),
               {"all pressures above 0 are 7", "give `threshold`"});
  expect_named(input_error([] { threshold_of({0.0, 0.0, -1.0}); }), {"no pressure is above 0"});
}

/// Six touches of 30 x 30 elements, 1 mm apart: noise, and contact in the middle with crosstalk
/// around.
struct NoisyPresses {
  NoisyPresses(bool clipped, double crosstalk) {
    recording.elements_mm = grid_array(30, 30, 1.0);
    Uniform random(43);
    for (int touch = 0; touch < 6; ++touch) {
      recording.T_robot_sensor.emplace_back();
      for (const glm::dvec2& element : recording.elements_mm) {
        const double least = std::min(std::abs(element.x), std::abs(element.y));
        const double most = std::max(std::abs(element.x), std::abs(element.y));
        const double noise = sd * normal(random);
        // Two elements beside an edge of the contact, it is over.
        const double pressure = most < 4.0                  ? 20.0
                                : most < 6.0 && least < 4.0 ? crosstalk + noise
                                                            : noise;
        recording.pressure.push_back(clipped ? std::max(0.0, pressure) : pressure);
      }
    }
  }
  double floor() const {
    const std::vector<Press> presses{
        {.name = "noise", .label = "L", .touches = all_touches(recording)}};
    return noise_floor(presses, {.threshold = 6.0, .ratio = 0.5});
  }

  static constexpr double sd = 0.7;
  Recording recording;
};

TEST(NoiseFloor, IsTheDeviationOfUntouchedElements) {
  // About 4700 readings tell it within 1 %, half of them cut off within 1.6 %.
  for (const bool clipped : {true, false}) {
    for (const double crosstalk : {0.0, 5.0}) {
      EXPECT_NEAR(NoisyPresses(clipped, crosstalk).floor(), 0.7, 0.035) << clipped << crosstalk;
    }
  }
  EXPECT_EQ(noise_floor(RowPress({{20.0, 21.0, 0.5}}).presses, {}), 0.0) << "all are touched";
}

TEST(NoiseFloor, CountsContactBelowTheRatioAndNoDeadElements) {
  // 8 is Unknown by the ratio beside 20, but no noise.
  NoisyPresses low(false, 0.0);
  for (std::size_t i = 0; i < low.recording.pressure.size(); ++i) {
    const glm::dvec2& element = low.recording.elements_mm[i % 900];
    if (std::max(std::abs(element.x - 10.0), std::abs(element.y - 10.0)) < 2.0) {
      low.recording.pressure[i] = 8.0;
    }
  }
  EXPECT_NEAR(low.floor(), 0.7, 0.035);
  NoisyPresses dead(true, 0.0);
  dead.recording.valid.assign(900, 1);
  dead.recording.valid[0] = 0;
  for (std::size_t touch = 0; touch < 6; ++touch) {
    dead.recording.pressure[900 * touch] = 500.0;
  }
  EXPECT_NEAR(dead.floor(), 0.7, 0.035);
}

/// Readings of a random map, drawn from Eq. 7 normalised.
LevelCounts drawn_counts(double gamma, double prior, std::uint64_t seed) {
  Uniform random(seed);
  LevelCounts counts(2);
  for (int i = 0; i < 20'000; ++i) {
    const double value = random(-8.0, 8.0);
    const double p = probability_from_log_odds(value);
    const double contact =
        (gamma * prior + (1.0 - gamma) * p) / (1.0 - gamma * (1.0 - 2.0 * prior));
    counts.add(random(0.0, 1.0) < contact ? Reading::in_contact : Reading::no_contact, value);
  }
  return counts;
}

TEST(GammaFit, RecoversWhatReadingsWereDrawnWith) {
  for (const double gamma : {0.05, 0.1, 0.3}) {
    for (const double prior : {0.1, 0.2, 0.5}) {
      EXPECT_NEAR(fit_gamma(drawn_counts(gamma, prior, 45), prior), gamma, 0.02)
          << gamma << " with prior " << prior;
    }
  }
}

TEST(GammaFit, LeavesOutCellsThatNothingSensed) {
  LevelCounts counts = drawn_counts(0.1, 0.2, 46);
  const double sensed = fit_gamma(counts, 0.2);
  for (const double value : {ReadingLayer::beyond, ReadingLayer::near_free}) {
    counts.add(Reading::in_contact, value, 40'000.0);
  }
  EXPECT_EQ(fit_gamma(counts, 0.2), sensed);
}

TEST(ShareInContact, CountsKnownElementsWithinBounds) {
  const auto share = [](const RowPress& row, const ContactClassifier& classifier = {}) {
    return share_in_contact(evidence_of(row.presses[0].touches, {.classifier = classifier}));
  };
  // Three In Contact, one Unknown (between the threshold and half of 20), two dead, four of none.
  EXPECT_NEAR(share(RowPress({{20.0, 20.0, 15.0, 5.0, 20.0, 20.0, 0.0, 0.0, 1.0, 0.5}},
                             {1, 1, 1, 1, 0, 0, 1, 1, 1, 1}),
                    {.threshold = 2.0, .ratio = 0.5}),
              3.5 / 8.0, 1e-12);
  std::vector<double> weak(200, 0.0);
  weak.back() = 1.0;  // where all are the same, they are Unknown
  EXPECT_EQ(share(RowPress({weak})), 0.01);
  EXPECT_EQ(share(RowPress({std::vector<double>(200, 20.0)})), 0.5);
}

TEST(LevelEdges, PartContactsIntoEqualShares) {
  std::vector<double> pressures(40, 0.0);
  for (int i = 40; i < 100; ++i) {
    pressures.push_back(100.0 + i);
  }
  const auto edges = [&](std::size_t levels) {
    const ReadingOptions options{.threshold = 2.0, .ratio = 0.1, .spacing_mm = 1.0};
    return learn_readings(RowPress({pressures}).presses, options).level_edges(levels);
  };
  EXPECT_EQ(edges(5), (std::vector<double>{155.0, 170.0, 185.0}));
  EXPECT_TRUE(edges(2).empty());
  std::fill(pressures.begin() + 40, pressures.end(), 50.0);
  EXPECT_TRUE(edges(5).empty()) << "one pressure has one level";
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
  const ReadingOptions given{.threshold = 1.0, .spacing_mm = 2.0};
  EXPECT_EQ(learn_readings(presses, given).classifier.threshold, 1.0);
}

LabelledFeatures press(const char* label, double value) {
  return {label, {{value, 2.0 * value, 7.0}}};
}

/// With what keeps like presses from being demanded alike.
double sd(double variance) { return std::sqrt(variance + 0.05 * 0.05); }

TEST(FeatureLearning, DrawsDeviationsTowardsThePooledOnes) {
  const std::vector<LabelledFeatures> presses{press("A", 1.0), press("A", 3.0), press("B", 10.0),
                                              press("B", 16.0)};
  const LearnedFeatures learned = learn_features(presses);
  // Squared differences: A 2, B 18; pooled 20 / 2. Shrunk: (2 + 4 * 10) / 6 and (18 + 40) / 6.
  EXPECT_DOUBLE_EQ(learned.objects.at("A").mean[0], 2.0);
  EXPECT_NEAR(learned.objects.at("A").sd[0], sd(42.0 / 6.0 * 1.5), 1e-9);
  EXPECT_NEAR(learned.objects.at("B").sd[0], sd(58.0 / 6.0 * 1.5), 1e-9);
  EXPECT_NEAR(learned.objects.at("B").sd[1], sd(4.0 * 58.0 / 6.0 * 1.5), 1e-9);
  EXPECT_DOUBLE_EQ(learned.objects.at("A").sd[2], 0.05) << "the least deviation";
  EXPECT_DOUBLE_EQ(learned.any.mean[0], 7.5);
  EXPECT_NEAR(learned.any.sd[0], sd(141.0 / 3.0), 1e-9);
  EXPECT_EQ(learned.weight, 0.0);
}

TEST(FeatureLearning, LearnsWhichFeaturesGoTogether) {
  // The force is the area's double or so, and the peak goes its own way.
  const std::vector<LabelledFeatures> presses{{"A", {{1.0, 2.1, 5.0}}}, {"A", {{2.0, 3.9, 5.2}}},
                                              {"A", {{3.0, 6.1, 5.2}}}, {"A", {{4.0, 7.9, 5.0}}},
                                              {"B", {{1.0, 1.0, 1.0}}}, {"B", {{1.0, 1.0, 1.0}}}};
  const FeatureDistribution learned = learn_features(presses).objects.at("A");
  EXPECT_GT(learned.correlation[0], 0.9);
  EXPECT_LT(learned.correlation[0], 1.0);
  EXPECT_NEAR(learned.correlation[1], 0.0, 0.05);
  const std::vector<LabelledFeatures> proportional{press("A", 1.0), press("A", 1e6)};
  EXPECT_NEAR(learn_features(proportional).any.correlation[0], 0.999, 1e-6)
      << "rounding in a file breaks none so high";
}

TEST(FeatureLearning, OfOnePressEachTakesAllPressesAndOfOneIsFinite) {
  // The variance of both is 8; (0 + 4 * 8) / 5 * 2.
  const LearnedFeatures both = learn_features(std::vector{press("A", 1.0), press("B", 5.0)});
  EXPECT_NEAR(both.objects.at("A").sd[0], sd(12.8), 1e-9);
  const LearnedFeatures one = learn_features(std::vector{press("A", 1.0)});
  EXPECT_DOUBLE_EQ(one.objects.at("A").sd[0], 0.05);
  EXPECT_DOUBLE_EQ(one.any.sd[0], 0.05);
}

}  // namespace palpate::contact_learning_test
