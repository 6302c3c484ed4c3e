// Touches of uncertain pose, objects that slip between touches, and "none of these", against their
// definitions in float64.

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "palpate/error.hpp"
#include "palpate/pose_error.hpp"
#include "palpate/pose_histogram.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

/// What the method allows a mean likelihood to differ from float64, in nats per touch.
constexpr double per_mean = 1e-3;

using Logs = std::vector<double>;

const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 12.0, 71), 2.0},
                                           {random_map(23, 29, 0.5, 12.0, 72), 1.0}};
  return two;
}

struct Case {
  const char* name;
  PoseLattice lattice;
  DisplacementSd sd;
  double gamma = 0.1;
};

/// [touch][object][bin]: every touch's likelihood, averaged where touches are uncertain.
std::vector<std::vector<Logs>> reference_touches(const HistogramOptions& options,
                                                 std::span<const Touch> touches) {
  std::vector<std::vector<Logs>> logs;
  for (const Touch& touch : touches) {
    logs.emplace_back();
    for (std::size_t object = 0; object < objects().size(); ++object) {
      logs.back().push_back(reference::displaced_touch(
          reference::log_likelihoods(std::span(&touch, 1), options.lattice, objects()[object].map,
                                     options.contact, object),
          options.lattice, options.touch_sd, touch.T_robot_sensor));
    }
  }
  return logs;
}

/// The belief after these touches.
reference::Posterior expected_posterior(const HistogramOptions& options,
                                        std::span<const std::vector<Logs>> logs) {
  reference::Posterior posterior{.lattice = options.lattice, .log_likelihood = {}, .weight = {}};
  for (std::size_t object = 0; object < objects().size(); ++object) {
    Logs belief(static_cast<std::size_t>(options.lattice.bins()), 0.0);
    for (std::size_t i = 0; i < logs.size(); ++i) {
      if (i > 0 && !options.slip_sd.none()) {
        belief = reference::slipped(belief, options.lattice, options.slip_sd,
                                    reference::body_of(objects()[object].map).centroid_mm);
      }
      for (std::size_t bin = 0; bin < belief.size(); ++bin) {
        belief[bin] += logs[i][object][bin];
      }
    }
    posterior.log_likelihood.push_back(belief);
    posterior.weight.push_back(objects()[object].weight);
  }
  return posterior;
}

reference::Posterior expected_posterior(const HistogramOptions& options,
                                        std::span<const Touch> touches) {
  return expected_posterior(options, reference_touches(options, touches));
}

/// Small lattices: around some bins a Gaussian lies inside, and at the edges it is cut off.
std::vector<Case> cases() {
  const PoseLattice plain{.x_mm = {-5.0, 6.0, 11},
                          .y_mm = {-4.0, 5.0, 13},
                          .theta_rad = {0, two_pi, 16},
                          .pivot_mm = {3.0, -2.0}};
  PoseLattice part = plain;
  part.theta_rad = {0.4, 2.2, 9};
  PoseLattice one_theta = plain;
  one_theta.theta_rad = {0.7, 0.7, 1};
  PoseLattice one_x = plain;
  one_x.x_mm = {1.5, 1.5, 1};
  PoseLattice wide_x = plain;
  wide_x.x_mm = {-5.0, 6.0, 1};
  PoseLattice one_y = plain;
  one_y.y_mm = {-0.5, -0.5, 1};
  // A step of theta moves the array by 2 mm.
  PoseLattice far = plain;
  far.pivot_mm = {-600.0, 800.0};
  far.theta_rad = {0.7, 0.718, 9};
  const PoseLattice fine{
      .x_mm = {-1.8, 1.8, 37}, .y_mm = {-0.7, 0.7, 13}, .theta_rad = {0, 0.39, 7}};
  const PoseLattice near{.x_mm = {-5.0, 5.0, 9},
                         .y_mm = {-5.0, 5.0, 10},
                         .theta_rad = {0, two_pi, 40},
                         .pivot_mm = {3.0, -2.0}};
  const DisplacementSd sd{.mm = 1.0, .rad = 0.2};
  return {{"plain", plain, sd},
          {"part of the circle", part, sd},
          {"a single theta", one_theta, sd},
          {"a fixed x, below the bins' steps", one_x, {.mm = 0.2, .rad = 0.1}},
          {"one wide bin of x", wide_x, sd},
          {"a fixed y, theta alone", one_y, {.rad = 0.3}},
          {"a pivot a metre away", far, {.mm = 1.0, .rad = 0.002}},
          {"as wide as the region", part, {.mm = 9.0, .rad = 1.5}},
          // Without a floor a single element may cost a thousand nats: neighbouring bins then lie
          // farther apart than a float's range.
          {"no floor, fine", fine, {.mm = 0.4, .rad = 0.04}, 0.0},
          // Neighbouring planes lie farther apart than the range of a float, too.
          {"no floor", near, sd, 0.0}};
}

class TouchByTouch : public testing::Test {
 protected:
  /// Elements over [-6, 6]^2 mm, poses over [-8, 8]^2 mm.
  const Recording recording = random_recording(3, 40, 73);
  const std::vector<Touch> touches = all_touches(recording);
  Device device = Device::open();
};

TEST_F(TouchByTouch, AveragesATouchAsTheReferenceDoes) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    HistogramOptions options{.lattice = c.lattice, .touch_sd = c.sd};
    options.contact.gamma = c.gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, objects(), options);
    const std::span<const Touch> two = std::span(touches).first(2);
    histogram.update(two);
    EXPECT_LT(likelihood_error(histogram, expected_posterior(options, two)), 2 * per_mean);
  }
}

TEST_F(TouchByTouch, AveragesALargeArray) {
  // 900 elements tell planes apart by hundreds of nats, floor or not.
  const Recording large = random_recording(1, 900, 74);
  const Touch touch = large.touch(0);
  for (const double gamma : {0.1, 1e-6}) {
    HistogramOptions options{
        .lattice = {.x_mm = {-3.0, 3.0, 9}, .y_mm = {-3.0, 3.0, 8}, .theta_rad = {0, two_pi, 30}},
        .touch_sd = {.mm = 1.0, .rad = 0.2}};
    options.contact.gamma = gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, objects(), options);
    histogram.update(touch);
    // Rounding of a touch's own likelihood grows with its elements, 1e-4 nats for 36.
    EXPECT_LT(likelihood_error(histogram, expected_posterior(options, std::span(&touch, 1))),
              per_mean + 1e-4 * 900.0 / 36.0);
  }
}

TEST_F(TouchByTouch, SlipsAsTheReferenceDoes) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    HistogramOptions options{.lattice = c.lattice, .slip_sd = c.sd};
    options.contact.gamma = c.gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, objects(), options);
    histogram.update(touches);
    const reference::Posterior expected = expected_posterior(options, touches);
    // Without a floor, log-likelihoods are thousands of nats, of which float32 keeps 6 digits.
    EXPECT_LT(likelihood_error(histogram, expected),
              (c.gamma > 0.0 ? per_mean : 5e-3) * static_cast<double>(touches.size()));
    EXPECT_LT(largest_difference(histogram.estimate().identity, reference::identity(expected)),
              1e-3);
  }
}

TEST_F(TouchByTouch, SlippingSaysNothingAboutTheObject) {
  HistogramOptions options{.lattice = cases().front().lattice, .slip_sd = {.mm = 1.0, .rad = 0.2}};
  PoseHistogram histogram(device, objects(), options);
  PoseHistogram at_rest(device, objects(), {.lattice = options.lattice});
  // A touch without a known element says nothing either; only the slip comes between.
  const Touch felt = touches.front();
  const std::vector<std::uint8_t> dead(felt.elements_mm.size(), 0);
  Touch silent = felt;
  silent.valid = dead;
  for (PoseHistogram* one : {&histogram, &at_rest}) {
    one->update(felt);
    one->update(silent);
  }
  EXPECT_LT(largest_difference(histogram.estimate().identity, at_rest.estimate().identity), 1e-5);
  EXPECT_GT(largest_difference(histogram.log_likelihood(0), at_rest.log_likelihood(0)), 0.1);
}

TEST_F(TouchByTouch, TakesUncertaintySlipAndNoneTogether) {
  for (const double gamma : {0.1, 0.0}) {
    HistogramOptions options{.lattice = cases().front().lattice,
                             .none_weight = 3.0,
                             .touch_sd = {.mm = 0.8, .rad = 0.1},
                             .slip_sd = {.mm = 0.7, .rad = 0.3}};
    options.contact.gamma = gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, objects(), options);
    histogram.update(touches);
    EXPECT_LT(likelihood_error(histogram, expected_posterior(options, touches)),
              (gamma > 0.0 ? per_mean : 5e-3) * static_cast<double>(touches.size()));
  }
}

/// The log odds of "none of these" by its definition.
double expected_log_odds_of_none(const HistogramOptions& options, std::span<const Touch> touches,
                                 const std::vector<std::vector<Logs>>& by_touch) {
  const reference::Posterior posterior =
      expected_posterior(options, std::span(by_touch).first(touches.size()));
  std::vector<double> evidence;
  for (std::size_t i = 0; i < objects().size(); ++i) {
    const Logs& logs = posterior.log_likelihood[i];
    const double most = *std::max_element(logs.begin(), logs.end());
    double sum = 0.0;
    for (const double l : logs) {
      sum += std::exp(l - most);
    }
    evidence.push_back(std::log(objects()[i].weight / static_cast<double>(logs.size())) + most +
                       std::log(sum));
  }
  const double most = *std::max_element(evidence.begin(), evidence.end());
  double sum = 0.0;
  for (const double e : evidence) {
    sum += std::exp(e - most);
  }
  return std::log(*options.none_weight) +
         reference::none_log_evidence(touches, options.lattice, objects(), by_touch) - most -
         std::log(sum);
}

double log_odds_of_none(const PoseHistogram& histogram) {
  const double none = histogram.estimate().none;
  return std::log(none / (1.0 - none));
}

/// The share of an object's bins at which the array overlaps it.
double share_of_overlap(const Touch& touch, const PoseLattice& lattice, const OccupancyGrid& map) {
  std::int64_t bins = 0;
  for (std::int64_t bin = 0; bin < lattice.bins(); ++bin) {
    bins += reference::overlaps(touch, reference::bin_pose(lattice, bin), map) ? 1 : 0;
  }
  return static_cast<double>(bins) / static_cast<double>(lattice.bins());
}

TEST_F(TouchByTouch, NoneIsTheProductOfMeanLikelihoods) {
  // So far out that the array misses the objects at many bins.
  Recording far = recording;
  for (Pose& pose : far.T_robot_sensor) {
    pose.translation_mm = 0.3 * pose.translation_mm + glm::dvec2(17.0, 1.0);
  }
  const std::vector<Touch> some_miss = all_touches(far);
  for (const Hypothesis& object : objects()) {
    const double share = share_of_overlap(some_miss[0], cases().front().lattice, object.map);
    EXPECT_GT(share, 0.2);
    EXPECT_LT(share, 0.8);
  }
  for (const DisplacementSd& sd : {DisplacementSd{}, DisplacementSd{.mm = 1.0, .rad = 0.2}}) {
    for (const double gamma : {0.1, 0.0}) {
      HistogramOptions options{
          .lattice = cases().front().lattice, .none_weight = 3.0, .touch_sd = sd};
      options.contact.gamma = gamma;
      options.contact.prior = 0.2;
      PoseHistogram histogram(device, objects(), options);
      EXPECT_NEAR(histogram.estimate().none, 0.5, 1e-12);  // before any touch: W over all weights
      const std::vector<std::vector<Logs>> by_touch = reference_touches(options, some_miss);
      for (std::size_t n = 1; n <= some_miss.size(); ++n) {
        histogram.update(some_miss[n - 1]);
        EXPECT_NEAR(log_odds_of_none(histogram),
                    expected_log_odds_of_none(options, std::span(some_miss).first(n), by_touch),
                    (gamma > 0.0 ? per_mean : 5e-3) * static_cast<double>(n));
      }
    }
  }
}

TEST_F(TouchByTouch, NoneIsDeafToATouchWithoutAKnownElement) {
  const std::vector<std::uint8_t> dead(touches[0].elements_mm.size(), 0);
  Touch silent = touches[0];
  silent.T_robot_sensor.translation_mm += glm::dvec2(100.0, 0.0);
  silent.valid = dead;
  const HistogramOptions options{.lattice = cases().front().lattice, .none_weight = 3.0};
  PoseHistogram histogram(device, objects(), options);
  PoseHistogram without(device, objects(), options);
  histogram.update(silent);
  EXPECT_NEAR(histogram.estimate().none, 0.5, 1e-12);
  for (const Touch& touch : touches) {
    histogram.update(touch);
    histogram.update(silent);
    without.update(touch);
  }
  EXPECT_NEAR(histogram.estimate().none, without.estimate().none, 1e-9);
}

TEST_F(TouchByTouch, SamplesTheObjectsWhereNoneTakesAllOfTheMass) {
  HistogramOptions options{.lattice = cases().front().lattice, .none_weight = 1e300};
  PoseHistogram histogram(device, objects(), options);
  options.none_weight.reset();
  PoseHistogram without(device, objects(), options);
  // Weights of 1e300 alone leave the objects 1e-300; touches that share no object do the rest.
  for (int round = 0; round < 8; ++round) {
    histogram.update(touches);
    without.update(touches);
  }
  ASSERT_EQ(histogram.estimate().none, 1.0);
  EXPECT_NEAR(histogram.entropy(), without.entropy(), 1e-2);
  const std::vector<PoseSample> drawn = histogram.sample(64, 5);
  const std::vector<PoseSample> expected = without.sample(64, 5);
  ASSERT_EQ(drawn.size(), expected.size());
  int other_object = 0;
  for (std::size_t i = 0; i < drawn.size(); ++i) {
    other_object += drawn[i].object != expected[i].object ? 1 : 0;
    EXPECT_LT(glm::length(drawn[i].T_object_robot.translation_mm), 30.0);
  }
  EXPECT_LE(other_object, 1);
}

TEST_F(TouchByTouch, NoneTakesAllBinsWhereTheArrayMeetsNoObject) {
  HistogramOptions options{.lattice = cases().front().lattice, .none_weight = 3.0};
  Recording far = recording;
  for (Pose& pose : far.T_robot_sensor) {
    pose.translation_mm += glm::dvec2(100.0, 0.0);
  }
  PoseHistogram histogram(device, objects(), options);
  histogram.update(all_touches(far));
  // Every bin of every object sees nothing but the prior: nobody is favoured.
  EXPECT_NEAR(histogram.estimate().none, 0.5, 1e-6);
}

TEST_F(TouchByTouch, ForgetsAtAReset) {
  const HistogramOptions options{.lattice = cases().front().lattice,
                                 .none_weight = 1.0,
                                 .touch_sd = {.mm = 0.8, .rad = 0.1},
                                 .slip_sd = {.mm = 0.7, .rad = 0.3}};
  PoseHistogram histogram(device, objects(), options);
  const auto told = [&] {
    histogram.update(touches);
    return std::pair(histogram.log_likelihood(1), histogram.estimate().none);
  };
  const auto first = told();
  histogram.reset();
  EXPECT_EQ(told(), first);
}

TEST_F(TouchByTouch, APreparedTouchIsTheSame) {
  const HistogramOptions options{
      .lattice = cases().front().lattice, .none_weight = 1.0, .touch_sd = {.mm = 0.8, .rad = 0.1}};
  PoseHistogram plain(device, objects(), options);
  PoseHistogram prepared(device, objects(), options);
  for (const Touch& touch : touches) {
    plain.update(touch);
    prepared.prepare(touches.back());  // mostly another one
    prepared.prepare(touch);
    prepared.update(touch);
    EXPECT_EQ(plain.log_likelihood(0), prepared.log_likelihood(0));
    EXPECT_EQ(plain.estimate().none, prepared.estimate().none);
  }
}

TEST_F(TouchByTouch, APreparedTouchSurvivesASlip) {
  const HistogramOptions options{.lattice = cases().front().lattice,
                                 .touch_sd = {.mm = 0.8, .rad = 0.1},
                                 .slip_sd = {.mm = 0.5, .rad = 0.1}};
  PoseHistogram plain(device, objects(), options);
  PoseHistogram prepared(device, objects(), options);
  for (const Touch& touch : touches) {
    plain.update(touch);
    prepared.prepare(touch);
    prepared.update(touch);
    EXPECT_EQ(plain.log_likelihood(0), prepared.log_likelihood(0));
  }
}

TEST_F(TouchByTouch, TakesAStillArray) {
  Recording presses = recording;
  presses.T_robot_sensor.assign(presses.size(), presses.T_robot_sensor.front());
  for (std::size_t i = 0; i < presses.pressure.size(); ++i) {
    presses.pressure[i] = i % 4 == 0 ? presses.pressure[i] : 0.0;  // mostly No Contact
  }
  HistogramOptions options{.lattice = cases().front().lattice,
                           .still_array = true,
                           .none_weight = 1.0,
                           .touch_sd = {.mm = 0.8, .rad = 0.1}};
  options.contact.prior = 0.2;
  PoseHistogram histogram(device, objects(), options);
  const std::vector<Touch> pressed = all_touches(presses);
  histogram.update(pressed);
  EXPECT_LT(likelihood_error(histogram, expected_posterior(options, pressed)),
            per_mean * static_cast<double>(pressed.size()));
}

TEST_F(TouchByTouch, TakesAnArrayThatChanges) {
  // Each touch with elements of its own, and fewer from touch to touch.
  std::vector<std::vector<glm::dvec2>> elements;
  std::vector<Touch> changing;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const std::size_t kept = touches[i].elements_mm.size() - 10 * i;
    elements.emplace_back(touches[i].elements_mm.begin(), touches[i].elements_mm.begin() + kept);
    for (glm::dvec2& element : elements.back()) {
      element += glm::dvec2(0.4 * static_cast<double>(i), 0.0);
    }
  }
  for (std::size_t i = 0; i < touches.size(); ++i) {
    changing.push_back({.T_robot_sensor = touches[i].T_robot_sensor,
                        .elements_mm = elements[i],
                        .pressure = touches[i].pressure.first(elements[i].size())});
  }
  HistogramOptions options{
      .lattice = cases().front().lattice, .none_weight = 1.0, .touch_sd = {.mm = 0.8, .rad = 0.1}};
  options.contact.prior = 0.2;
  PoseHistogram histogram(device, objects(), options);
  histogram.update(changing);
  const std::vector<std::vector<Logs>> by_touch = reference_touches(options, changing);
  const double allowed = per_mean * static_cast<double>(changing.size());
  EXPECT_LT(likelihood_error(histogram, expected_posterior(options, by_touch)), allowed);
  EXPECT_NEAR(log_odds_of_none(histogram), expected_log_odds_of_none(options, changing, by_touch),
              allowed);
}

TEST_F(TouchByTouch, RefusesWhatALatticeDoesNotTake) {
  const auto refuse = [&](const DisplacementSd& sd) {
    EXPECT_THROW(
        PoseHistogram(device, objects(), {.lattice = cases().front().lattice, .touch_sd = sd}),
        Error);
    EXPECT_THROW(
        PoseHistogram(device, objects(), {.lattice = cases().front().lattice, .slip_sd = sd}),
        Error);
  };
  refuse({.mm = -1.0});
  refuse({.rad = std::nan("")});
  refuse({.mm = 30.0});
}

}  // namespace
}  // namespace palpate
