// Temperature and press features, with numbers that were worked out by hand, and the bounds of
// labels from those of their hypotheses' evidence.

#include "recognition/label_probability.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "recognition/filter_choice.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/scales.hpp"
#include "shapes.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"
#include "support/trials.hpp"

namespace palpate::label_probability_test {

/// Two labels of three maps.
RecognitionTask two_labels(const FilterOptions& filter = HistogramOptions{}) {
  return {three_maps(), filter};
}

/// Evidence of 3 and 1 of the maps of L, of 1 of the disc.
Estimate four_to_one() {
  return {.identity = {0.6, 0.2, 0.2}, .log_evidence = {std::log(3.0), 0.0, 0.0}};
}

/// Presses of two elements in contact of three, with features log 3, log 8 and log 6.
std::vector<Touch> presses(std::size_t count) {
  static const std::vector<glm::dvec2> elements_mm(3);
  static const std::vector<double> pressure{10.0, 0.0, 4.0};
  return std::vector<Touch>(
      count, {.T_robot_sensor = {}, .elements_mm = elements_mm, .pressure = pressure});
}
constexpr std::array<double, 3> features_of_one{3.0, 8.0, 6.0};

/// The step after so many of these presses.
RecognitionStep step_after(std::size_t count, const Estimate& estimate,
                           const RecognitionTask& task) {
  return judge(estimate, {}, task, evidence_of(presses(count), task.contact()));
}

/// Any object's features are about 0, and the letter's about those of the press.
LearnedFeatures features_of_the_letter() {
  FeatureDistribution any{.mean = {0.0, 0.0, 0.0}, .sd = {1.0, 1.0, 1.0}};
  FeatureDistribution letter = any;
  std::ranges::transform(features_of_one, letter.mean.begin(),
                         [](double x) { return std::log(x); });
  return {.weight = 0.5, .any = any, .objects = {{"L", letter}}};
}

/// What one press says for the letter: half of half the squared distance to any object's mean.
double nats_of_one_press() {
  double squares = 0.0;
  for (const double one : features_of_one) {
    squares += std::log(one) * std::log(one);
  }
  return 0.5 * 0.5 * squares;
}

TEST(LabelProbability, IsARootOfTheEvidenceTimesWhatFeaturesSay) {
  const double press = std::exp(nats_of_one_press());
  struct Row {
    const char* name;
    double temperature;
    double growth;
    std::size_t presses;
    bool features;
    std::optional<double> none;  ///< evidence
    std::vector<double> odds;    ///< of L, the disc and "(none)"
  };
  const Row rows[] = {
      {"sum of the maps", 1.0, 0.0, 0, false, {}, {4.0, 1.0}},
      {"root of the evidence", 2.0, 0.0, 0, false, {}, {2.0, 1.0}},
      {"root of none's, too", 2.0, 0.0, 0, false, 9.0, {2.0, 1.0, 3.0}},
      {"first touch", 1.0, 0.5, 1, false, {}, {4.0, 1.0}},
      {"second touch", 1.0, 0.5, 2, false, {}, {std::pow(4.0, 1.0 / 1.5), 1.0}},
      {"third touch", 1.0, 0.5, 3, false, {}, {2.0, 1.0}},
      {"features, none's as any's", 2.0, 0.0, 2, true, 1.0, {2.0 * press * press, 1.0, 1.0}},
      {"features that turn it round", 1.0, 0.0, 1, true, 5.0, {4.0 * press, 1.0, 5.0}}};
  for (const auto& [name, temperature, growth, presses, features, none, odds] : rows) {
    SCOPED_TRACE(name);
    RecognitionTask task =
        two_labels(HistogramOptions{.none_weight = none ? std::optional(1.0) : std::nullopt});
    task.sensor.temperature = temperature;
    task.sensor.temperature_growth = growth;
    if (features) {
      task.sensor.features = features_of_the_letter();
    }
    Estimate estimate = four_to_one();
    if (none) {
      estimate.none_log_evidence = std::log(*none);
    }
    const RecognitionStep step = step_after(presses, estimate, task);
    const double total = std::accumulate(odds.begin(), odds.end(), 0.0);
    ASSERT_EQ(step.identity.size(), odds.size());
    for (std::size_t i = 0; i < odds.size(); ++i) {
      EXPECT_NEAR(step.identity[i], odds[i] / total, 1e-14);
    }
    EXPECT_EQ(odds[step.best], *std::ranges::max_element(odds));
  }
}

TEST(LabelProbability, IsNotTemperedByTouchesThatTellNothing) {
  RecognitionTask task = two_labels();
  task.sensor.temperature_growth = 0.5;
  std::vector<TouchEvidence> touches = evidence_of(presses(2), task.contact());
  touches[0].readings.assign(3, Reading::unknown);
  touches[0].contacts = 0;
  EXPECT_EQ(judge(four_to_one(), {}, task, touches).identity,
            step_after(1, four_to_one(), task).identity);
}

TEST(LabelProbability, ReachesEvidenceBelowEveryNumber) {
  RecognitionTask task = two_labels();
  task.sensor.temperature = 1000.0;
  for (const auto& [best, rounding] : {std::pair{0.0, 1e-14}, {-2e6, 1e-12}}) {
    const Estimate estimate{.identity = {1.0, 0.0, 0.0},
                            .log_evidence = {best, best - 2000.0, best - 9000.0}};
    const RecognitionStep step = judge(estimate, {}, task);
    EXPECT_NEAR(step.identity[1] / step.identity[0], std::exp(-2.0), rounding);
  }
}

TEST(LabelProbability, PassesOverTouchesWithoutContact) {
  RecognitionTask task = two_labels();
  task.sensor.features = features_of_the_letter();
  const std::vector<double> pressure{0.0, 0.5, 0.0};
  std::vector<Touch> touch = presses(1);
  touch[0].pressure = pressure;
  EXPECT_EQ(tempering_of(evidence_of(touch, task.contact()), task).features,
            std::vector<double>(2));
}

constexpr double nothing = -infinity;

/// Evidence of three hypotheses and of none, as a filter that evaluated the lows tells it; none's
/// is at most so many times as large.
Estimate estimate_of(const std::vector<LogInterval>& evidence, double none,
                     double none_at_most = 1.0) {
  Estimate estimate;
  double total = none;
  for (const LogInterval& one : evidence) {
    total += std::exp(one.low);
  }
  for (const LogInterval& one : evidence) {
    estimate.identity.push_back(std::exp(one.low) / total);
    estimate.log_evidence.push_back(one.low);
  }
  estimate.none = none / total;
  estimate.certificate = Certificate{.log_evidence = evidence};
  if (none > 0.0) {
    estimate.none_log_evidence = std::log(none);
    estimate.certificate->none_log_evidence =
        LogInterval{std::log(none), std::log(none_at_most * none)};
  }
  return estimate;
}

TEST(LabelBounds, AreTheProbabilitiesOfExactEvidenceHoweverTheseAreRounded) {
  const RecognitionTask task = two_labels(BoundedOptions{});
  const Estimate estimate = estimate_of({{-3.0, -3.0}, {-2.0, -2.0}, {-4.0, -4.0}}, 0.0);
  const Tempering tempering = tempering_of({}, task);
  std::vector<double> identity = label_probabilities(estimate, tempering, task);
  for (const double rounding : {1e-14, 1e-12}) {  // the first is of sums of three logs in float64
    identity[0] *= 1.0 - rounding;
    identity[1] *= 1.0 + rounding;
    const auto bounds = label_bounds(estimate, identity, tempering, task);
    ASSERT_EQ(bounds.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LE(bounds[i].low, identity[i]);
      EXPECT_GE(bounds[i].high, identity[i]);
      EXPECT_LE(bounds[i].high - bounds[i].low, 2.0 * rounding);
    }
  }
}

TEST(LabelBounds, HoldEveryEvidenceWithinItsBoundsAndAreReached) {
  Uniform random(3);
  for (int trial = 0; trial < trials(100); ++trial) {
    const double none = trial % 2 == 0 ? 0.0 : std::exp(random(-8.0, 2.0));
    RecognitionTask task =
        two_labels(BoundedOptions{.none_weight = none > 0.0 ? std::optional(1.0) : std::nullopt});
    task.sensor.temperature = 1.0 + trial % 3;
    const std::size_t presses = trial / 2 % 2;
    task.sensor.features = features_of_the_letter();
    std::vector<LogInterval> evidence;
    for (int h = 0; h < 3; ++h) {
      const double low = random(-6.0, 0.0);
      evidence.push_back({low, low + random(0.0, 3.0)});
    }
    const double none_at_most = random(1.0, 3.0);
    const RecognitionStep step =
        step_after(presses, estimate_of(evidence, none, none_at_most), task);
    std::vector<ProbabilityInterval> seen(task.labels.size(), {1.0, 0.0});
    for (int corner = 0; corner < 16; ++corner) {
      std::vector<double> sums(task.labels.size());
      for (std::size_t h = 0; h < 3; ++h) {
        const LogInterval& one = evidence[h];
        sums[task.label_of[h]] += std::exp((corner >> h) % 2 == 0 ? one.low : one.high);
      }
      if (none > 0.0) {
        sums.back() = corner < 8 ? none : none_at_most * none;
      }
      for (double& sum : sums) {
        sum = std::pow(sum, 1.0 / task.sensor.temperature);
      }
      sums[0] *= presses > 0 ? std::exp(nats_of_one_press()) : 1.0;
      const double total = std::accumulate(sums.begin(), sums.end(), 0.0);
      for (std::size_t i = 0; i < sums.size(); ++i) {
        seen[i].low = std::min(seen[i].low, sums[i] / total);
        seen[i].high = std::max(seen[i].high, sums[i] / total);
      }
    }
    ASSERT_EQ(step.identity_bounds.size(), seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      // A probability is monotone in each evidence, so that its extremes lie in the corners.
      EXPECT_NEAR(step.identity_bounds[i].low, seen[i].low, 1e-12);
      EXPECT_NEAR(step.identity_bounds[i].high, seen[i].high, 1e-12);
    }
  }
}

TEST(LabelBounds, OfEvidenceThatNothingOrAllIsKnownOf) {
  using Ends = std::vector<std::pair<double, double>>;
  const auto bounds = [](const Estimate& estimate, const RecognitionTask& task) {
    Ends ends;
    for (const auto& [low, high] : judge(estimate, {}, task).identity_bounds) {
      ends.emplace_back(low, high);
    }
    return ends;
  };
  const RecognitionTask two_maps({shapes()[0], shapes()[0]}, BoundedOptions{});
  EXPECT_EQ(bounds(estimate_of({{-9.0, 0.0}, {-8.0, -2.0}}, 0.0), two_maps), (Ends{{1.0, 1.0}}))
      << "one label, whichever of its maps it is";
  const Estimate below = estimate_of({{0.0, 0.0}, {nothing, -2000.0}, {nothing, 1.0}}, 0.0);
  EXPECT_EQ(bounds(below, two_labels(BoundedOptions{})), (Ends{{1.0, 1.0}, {0.0, 0.0}}))
      << "below every float64";
  const Estimate unknown{.identity = {1.0},
                         .certificate = Certificate{.log_evidence = {{nothing, 0.0}}}};
  EXPECT_EQ(bounds(unknown, {{shapes()[0]}, BoundedOptions{}}), (Ends{{0.0, 1.0}}))
      << "of a search that evaluated nothing, and no NaN";
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
  RecognitionTask task = two_labels(filter);
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
    EXPECT_NE(wider_bins(bounds, steps), "");
  }
  BoundedOptions uncertain = bounds;
  uncertain.touch_sd = {.mm = 2.0, .rad = 0.2};
  EXPECT_EQ(wider_bins(uncertain, BinSteps{0.6, 0.6, 0.06}), "") << "the belief is as smooth";
  expect_named(wider_bins(bounds, BinSteps{0.6, 0.5, 0.0436332}),
               {"bins are 1 x 1 mm x 5.73 degrees wide, wider than the 0.6 x 0.5 mm x 2.5 degrees",
                "too sure", "`bins 20x20x20`"});
  EXPECT_NE(wider_bins(bounds, BinSteps{1.0, 1.0, 0.0}), "") << "learned at a fixed angle";
  bounds.lattice.theta_rad = {0.0, 6.0, 1};
  EXPECT_NE(wider_bins(bounds, BinSteps{1.0, 1.0, 0.5}), "") << "one bin is as wide as the region";
  bounds.lattice.theta_rad = {1.0, 1.0, 1};
  EXPECT_EQ(wider_bins(bounds, BinSteps{1.0, 1.0, 0.06}), "") << "a fixed angle has no bins";
  EXPECT_EQ(wider_bins(ParticleOptions{}, BinSteps{0.6, 0.6, 0.0}), "") << "particles have none";
}

TEST(Misfit, CountsForNoneAloneWhereTheScaleWasLearned) {
  RecognitionTask task = two_labels(HistogramOptions{.none_weight = 0.2});
  const Fit fit{.z = -8.0};
  const auto features = [&] {
    return tempering_of(evidence_of(presses(3), task.contact()), task, fit).features;
  };
  EXPECT_EQ(features().back(), 0.0);
  task.sensor.fit_scale = FitScale{.mean = 0.1, .sd = 0.9, .shared_sd = 0.1};
  EXPECT_EQ(features().back(), misfit_nats(fit, 3, {.stranger_sd = usual_stranger_sd}));
  EXPECT_EQ(features().front(), 0.0);
  task.sensor.fit_scale->stranger_sd = 1.0;
  EXPECT_EQ(features().back(), misfit_nats(fit, 3, {.stranger_sd = 1.0}));
}

double nats(double z, std::size_t touches) { return misfit_nats({.z = z}, touches, {}); }

TEST(Misfit, SpeaksForNoneTheMoreTouchesThereAre) {
  EXPECT_EQ(nats(-4.0, 1), 0.0) << "a stranger's single touch fits as well";
  EXPECT_LT(nats(0.0, 3), -1.5);
  EXPECT_LT(nats(0.0, 9), nats(0.0, 3));
  EXPECT_GT(nats(-4.0, 3), 0.0);
  EXPECT_GT(nats(-8.0, 5), 2.0);
  EXPECT_TRUE(std::isfinite(nats(-largest_fit_z, 2)) && std::isfinite(nats(largest_fit_z, 2)));
}

TEST(Misfit, OfAGoodFitSpeaksAgainstNoneTheMoreTheWorseStrangersFit) {
  const Fit good{.z = 0.0};
  EXPECT_LT(misfit_nats(good, 3, {.stranger_sd = 8.0}), misfit_nats(good, 3, {.stranger_sd = 2.0}));
  EXPECT_EQ(misfit_nats(good, 3, {.stranger_sd = 0.0}), 0.0)
      << "strangers fit as learned objects do";
  const Fit bad{.z = -16.0};
  EXPECT_GT(misfit_nats(bad, 3, {.stranger_sd = 8.0}), misfit_nats(bad, 3, {.stranger_sd = 2.0}));
}

TEST(StrangerDensity, SumsToTheSameWhateverTheSpread) {
  const auto sum = [](std::size_t touches, double stranger_sd) {
    double all = 0.0;
    for (double z = -29.5; z < 30.0; z += 1.0) {
      all += stranger_density({.z = z}, touches, {.stranger_sd = stranger_sd});
    }
    return all;
  };
  EXPECT_NEAR(sum(3, 2.0), sum(1, 2.0), 1e-3 * sum(1, 2.0));
  EXPECT_NEAR(sum(2, 4.0), sum(3, 2.0), 1e-3 * sum(1, 2.0));
}

TEST(Misfit, OfOneTouchIsByWhatStrangersAreLike) {
  const Fit bad{.z = -6.0};
  EXPECT_EQ(misfit_nats(bad, 1, {}), 0.0) << "one touch of a stranger fits as well";
  const FitScale scale{.stranger_sd = 3.0, .stranger_single_touch = SingleFitScale{-6.0, 2.0}};
  EXPECT_GT(misfit_nats(bad, 1, scale), 2.0);
  EXPECT_LT(misfit_nats({.z = 0.0}, 1, scale), -2.0);
  EXPECT_EQ(misfit_nats(bad, 2, scale), misfit_nats(bad, 2, {.stranger_sd = 3.0}));
  // One in ten of either spreads wider, and all touches of another sensor do.
  const double learned =
      0.9 * std::exp(-2.0) / 3.0 + 0.1 * std::exp(-18.0 / (25.0 + 8.0)) / std::sqrt(25.0 + 8.0);
  const double stranger = 0.9 / 2.0 + 0.1 / std::sqrt(25.0 + 3.0);
  EXPECT_NEAR(misfit_nats(bad, 1, scale), std::log(stranger / learned), 1e-12);
}

TEST(NearbyFit, IsAsGoodAsThatOfTheTruePoseHalfAStepAway) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const ContactModel contact{.prior = 0.2};
  const Pose truth{{1.3, -0.8}, 0.7};
  const Recording recording = touches_of(on_letter_l, truth, 20, 856);
  const std::vector<Touch> touches = all_touches(recording);
  const double at_truth = fit_of(touches, truth, map, contact)->z;
  for (const glm::dvec2& off_mm : {glm::dvec2(0.375, 0.0), {-0.4375, 0.25}, {0.4, 0.4}}) {
    const Pose start{truth.translation_mm + off_mm, truth.theta_rad + 0.05};
    EXPECT_LT(fit_of(touches, start, map, contact)->z, at_truth - 1.0);
    // The best pose of these touches fits a little better than the true one.
    EXPECT_GT(best_fit_near(evidence_of(touches, contact), start, map, contact, 0)->z, at_truth);
  }
}

}  // namespace palpate::label_probability_test
