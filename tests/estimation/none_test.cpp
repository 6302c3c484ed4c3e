// "None of these", and touches that contradict everything.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <gtest/gtest.h>

#include "lattice/touch_by_touch_data.hpp"
#include "palpate/error.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/limits.hpp"
#include "support/synthetic.hpp"

namespace palpate::none_test {

/// What the method allows a mean likelihood to differ from float64, in nats per touch.
constexpr double per_mean = 1e-3;

HistogramOptions with_none(double weight) {
  HistogramOptions options;
  options.lattice = {.x_mm = {-5.0, 5.0, 9}, .y_mm = {-5.0, 5.0, 8}, .theta_rad = {0, two_pi, 6}};
  options.none_weight = weight;
  return options;
}

std::vector<Hypothesis> two_objects() {
  return {{random_map(31, 27, 0.5, 1.0, 151), 1.5}, {random_map(25, 25, 0.5, 1.0, 152), 0.5}};
}

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Maps that are sure of all that they say: full everywhere, and empty everywhere.
std::vector<Hypothesis> sure_objects() {
  std::vector<Hypothesis> objects(2, {random_map(61, 61, 0.5, 1.0, 157), 1.0});
  for (std::size_t k = 0; k < objects[0].map.log_odds.size(); ++k) {
    objects[0].map.log_odds[k] = 1000.0F;
    objects[1].map.log_odds[k] = -1000.0F;
  }
  return objects;
}

TEST(NoneOfThese, SumsToOneWithTheObjectsAndTheirPoses) {
  const std::vector<Hypothesis> objects = two_objects();
  const Recording recording = random_recording(3, 5, 153);
  Device device = Device::open();
  for (const double weight : {0.01, 1.0, 20.0}) {
    PoseHistogram histogram(device, objects, with_none(weight));
    for (const Touch& touch : all_touches(recording)) {
      histogram.update(touch);
      const Estimate estimate = histogram.estimate();
      EXPECT_EQ(estimate.identity.size(), 2U);
      EXPECT_NEAR(sum(estimate.identity) + estimate.none, 1.0, 1e-15) << "rounding";
      for (int object = 0; object < 2; ++object) {
        // Sums of some hundred float32 terms of one order.
        EXPECT_NEAR(sum(histogram.marginals(object).xy), estimate.identity[object], 1e-6);
      }
    }
  }
}

TEST(NoneOfThese, KeepsTheOddsOfTheWeightsAfterOneTouch) {
  // The array reaches both objects at every bin, so that a piece explains the touch as well as the
  // objects do on average.
  Recording recording = random_recording(1, 36, 165);
  recording.T_robot_sensor = {{{0.5, -1.0}, 0.4}};
  Device device = Device::open();
  for (const double weight : {0.01, 1.0, 20.0}) {
    PoseHistogram histogram(device, two_objects(), with_none(weight));
    histogram.update(all_touches(recording));
    EXPECT_NEAR(log_odds_of_none(histogram), std::log(weight / 2.0), per_mean);
  }
}

TEST(NoneOfThese, LosesByTouchesThatAgreeOnAPose) {
  // By Jensen's inequality the mean of a likelihood's square is above the square of its mean: the
  // same touch again speaks for the pose that explains it, which pieces do not share.
  Recording recording = random_recording(1, 36, 166);
  recording.T_robot_sensor = {{{0.5, -1.0}, 0.4}};
  Device device = Device::open();
  PoseHistogram histogram(device, two_objects(), with_none(1.0));
  double before = std::log(0.5);
  for (int times = 1; times <= 5; ++times) {
    histogram.update(all_touches(recording));
    const double after = log_odds_of_none(histogram);
    if (times > 1) {
      EXPECT_LT(after, before - per_mean);
    }
    before = after;
  }
}

TEST(NoneOfThese, WinsByTouchesThatShareNoObject) {
  // One object is full and the other one empty; one touch finds contact alone, and the other none.
  Recording recording;
  recording.elements_mm = {{-1, 0}, {1, 0}, {0, 1}};
  recording.T_robot_sensor = {{}, {}};
  recording.pressure = {9.0, 9.0, 9.0, 0.0, 0.0, 1.9};  // the last one is Unknown
  HistogramOptions options = with_none(1e-3);
  options.contact.gamma = 0.0;
  Device device = Device::open();
  PoseHistogram histogram(device, sure_objects(), options);
  histogram.update(recording.touch(0));
  EXPECT_NEAR(log_odds_of_none(histogram), std::log(1e-3 / 2.0), per_mean);
  histogram.update(recording.touch(1));
  EXPECT_EQ(histogram.estimate().none, 1.0);
}

TEST(NoneOfThese, BeforeAnyTouchHasItsWeightAndAfterAResetAgain) {
  const std::vector<Hypothesis> objects = two_objects();
  const Recording recording = random_recording(2, 36, 154);
  Device device = Device::open();
  PoseHistogram histogram(device, objects, with_none(2.0));
  for (int round = 0; round < 2; ++round) {
    EXPECT_NEAR(histogram.estimate().none, 0.5, 1e-15) << "2 of 1.5 + 0.5 + 2";
    histogram.update(all_touches(recording));
    EXPECT_GT(std::abs(histogram.estimate().none - 0.5), 1e-3);
    histogram.reset();
  }
}

TEST(NoneOfThese, ChangesNeitherTheModeNorTheOddsBetweenObjects) {
  const std::vector<Hypothesis> objects = two_objects();
  const Recording recording = random_recording(2, 5, 155);
  HistogramOptions options = with_none(1.0);
  Device device = Device::open();
  PoseHistogram with(device, objects, options);
  options.none_weight.reset();
  PoseHistogram without(device, objects, options);
  with.update(all_touches(recording));
  without.update(all_touches(recording));
  const Estimate a = with.estimate();
  const Estimate b = without.estimate();
  EXPECT_EQ(a.mode.bin, b.mode.bin);
  EXPECT_EQ(a.mode.object, b.mode.object);
  EXPECT_EQ(b.none, 0.0);
  EXPECT_NEAR(std::log(a.identity[0] / a.identity[1]), std::log(b.identity[0] / b.identity[1]),
              2 * per_mean);
}

TEST(NoneOfThese, WithAWeightThatIsNotPositiveIsRefused) {
  Device device = Device::open();
  for (const double weight : {0.0, -1.0, nan, infinity}) {
    EXPECT_THROW(PoseHistogram(device, two_objects(), with_none(weight)), Error) << weight;
  }
}

TEST(Contradiction, IsSaidWhereNothingExplainsTheTouches) {
  // Half of the elements in contact, half not: neither full nor empty.
  Recording recording;
  recording.elements_mm = {{-1, 0}, {1, 0}};
  recording.T_robot_sensor = {{}};
  recording.pressure = {9.0, 0.0};
  HistogramOptions options = with_none(1.0);
  options.contact.gamma = 0.0;
  Device device = Device::open();
  PoseHistogram histogram(device, sure_objects(), options);
  EXPECT_FALSE(histogram.estimate().contradicted) << "before any touch";
  histogram.update(all_touches(recording));
  const Estimate estimate = histogram.estimate();
  EXPECT_TRUE(estimate.contradicted);
  EXPECT_NEAR(estimate.mode.log_likelihood, -1000.0, 1.0);
  // A piece of an object explains the touch no better. float32 keeps 1e-4 of 1,000 nats.
  EXPECT_NEAR(estimate.none, 1.0 / 3.0, 1e-3);
  EXPECT_NEAR(sum(estimate.identity), 2.0 / 3.0, 1e-3);
  histogram.reset();
  EXPECT_FALSE(histogram.estimate().contradicted);

  recording.pressure = {9.0, 9.0};
  histogram.update(all_touches(recording));
  EXPECT_FALSE(histogram.estimate().contradicted) << "the full one explains it";
}

TEST(Contradiction, IsNotSaidWhereReadingsMayBeRandom) {
  Recording recording;
  recording.elements_mm = {{-1, 0}, {1, 0}};
  recording.T_robot_sensor = {{}};
  recording.pressure = {9.0, 0.0};
  HistogramOptions options = with_none(1.0);
  options.contact.gamma = 0.1;
  Device device = Device::open();
  PoseHistogram histogram(device, sure_objects(), options);
  histogram.update(all_touches(recording));
  EXPECT_FALSE(histogram.estimate().contradicted);
}

/// What the prior makes of a touch over what the best particle does, in nats, by the reference.
double prior_over_best(const ParticleFilter& filter, const Touch& touch,
                       const std::vector<Hypothesis>& objects, const ParticleOptions& options) {
  double best = -std::numeric_limits<double>::infinity();
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    best = std::max(best, reference::log_likelihood(touch, particle.T_object_robot,
                                                    objects[particle.object].map, options.contact));
  }
  const OccupancyGrid unseen{
      .nx = 1, .ny = 1, .log_odds = {static_cast<float>(objects.front().map.prior_log_odds())}};
  return reference::log_likelihood(touch, {}, unseen, options.contact) - best;
}

TEST(Contradiction, IsSaidByParticlesWhereTheReferenceSaysSo) {
  Device device = Device::open();
  const Recording recording = random_recording(8, 36, 158);
  const auto said = [&](double steepness, double gamma) {
    // So wide that no particle leaves its elements on what was never seen.
    const std::vector<Hypothesis> objects{{random_map(121, 121, 0.5, steepness, 159), 1.0},
                                          {random_map(121, 121, 0.5, steepness, 160), 1.0}};
    ParticleOptions options{.particles = 500, .region = {}};
    options.contact.gamma = gamma;
    ParticleFilter filter(device, objects, options);
    EXPECT_FALSE(filter.estimate().contradicted) << "before any touch";
    double nats = 0.0;
    int contradicted = 0;
    for (const Touch& touch : all_touches(recording)) {
      filter.update(touch);
      nats += prior_over_best(filter, touch, objects, options);
      EXPECT_GT(std::abs(nats - 700.0), 1.0) << "no matter of rounding";
      EXPECT_EQ(filter.estimate().contradicted, nats > 700.0) << nats << " nats";
      contradicted += nats > 700.0 ? 1 : 0;
    }
    filter.reset();
    EXPECT_FALSE(filter.estimate().contradicted);
    return contradicted;
  };
  const int with_time = said(150.0, 0.0);
  EXPECT_GT(with_time, 0);
  EXPECT_LT(with_time, 8) << "not by the first touch alone";
  EXPECT_EQ(said(1000.0, 0.0), 8);
  EXPECT_EQ(said(1000.0, 0.1), 0) << "readings may be random";
}

}  // namespace palpate::none_test
