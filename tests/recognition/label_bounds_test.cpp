// The bounds of labels from the bounds of their hypotheses' evidence.

#include "recognition/label_probability.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <optional>

#include "recognition/recognition_record.hpp"
#include "shapes.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"
#include "support/trials.hpp"

namespace palpate::label_bounds_test {

/// Labels L and disc, and with a weight "(none)".
RecognitionTask by_bounds(std::optional<double> none_weight = {}) {
  return {three_maps(), BoundedOptions{.none_weight = none_weight}};
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
  }
  estimate.none = none / total;
  estimate.certificate = Certificate{.log_evidence = evidence};
  if (none > 0.0) {
    estimate.certificate->none_log_evidence =
        LogInterval{std::log(none), std::log(none_at_most * none)};
  }
  return estimate;
}

TEST(LabelBounds, AreTheProbabilitiesOfExactEvidenceHoweverTheseAreRounded) {
  const RecognitionTask task = by_bounds();
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
    const RecognitionTask task = by_bounds(none > 0.0 ? std::optional(1.0) : std::nullopt);
    std::vector<LogInterval> evidence;
    for (int h = 0; h < 3; ++h) {
      const double low = random(-6.0, 0.0);
      evidence.push_back({low, low + random(0.0, 3.0)});
    }
    const double none_at_most = random(1.0, 3.0);
    const RecognitionStep step = judge(estimate_of(evidence, none, none_at_most), {}, task);
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
  EXPECT_EQ(bounds(below, by_bounds()), (Ends{{1.0, 1.0}, {0.0, 0.0}})) << "below every float64";
  const Estimate unknown{.identity = {1.0},
                         .certificate = Certificate{.log_evidence = {{nothing, 0.0}}}};
  EXPECT_EQ(bounds(unknown, {{shapes()[0]}, BoundedOptions{}}), (Ends{{0.0, 1.0}}))
      << "of a search that evaluated nothing, and no NaN";
}

class LabelBoundsOfAStep : public ByEveryFilter {};

TEST_P(LabelBoundsOfAStep, AreOfBoundsAlone) {
  const RecognitionTask task(shapes(), filter());
  for (const RecognitionStep& step : recognised(task, touched_letter(1), true).trace) {
    ASSERT_EQ(step.certificate.has_value(), bounded());
    ASSERT_EQ(step.identity_bounds.size(), bounded() ? 2u : 0u);
    for (std::size_t i = 0; i < step.identity_bounds.size(); ++i) {
      EXPECT_LE(step.certificate->dropped_mass, 1e-6) << "the tolerance";
      EXPECT_LE(step.identity_bounds[i].low, step.identity[i]);
      EXPECT_GE(step.identity_bounds[i].high, step.identity[i]);
      // All of the mass that is dropped may be of one label.
      EXPECT_LE(step.identity_bounds[i].high - step.identity_bounds[i].low, 2.1e-6);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(By, LabelBoundsOfAStep, each_filter, filter_name);

}  // namespace palpate::label_bounds_test
