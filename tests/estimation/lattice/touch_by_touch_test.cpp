// Touches of uncertain pose, and objects that slip between touches, against their definitions in
// float64.

#include <cmath>
#include <utility>
#include <vector>

#include "palpate/error.hpp"
#include "touch_by_touch_data.hpp"

namespace palpate::touch_by_touch_test {

struct Case {
  const char* name;
  PoseLattice lattice;
  DisplacementSd sd;
  double gamma = 0.1;
};

/// Small lattices: around some bins a Gaussian lies inside, and at the edges it is cut off.
std::vector<Case> cases() {
  const PoseLattice plain = small_lattice();
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

TEST_F(TouchByTouchTest, AveragesATouchAsTheReferenceDoes) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    HistogramOptions options{.lattice = c.lattice, .touch_sd = c.sd};
    options.contact.gamma = c.gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, two_maps(), options);
    const std::span<const Touch> two = std::span(touches).first(2);
    histogram.update(two);
    EXPECT_LT(likelihood_error(histogram, expected_posterior(options, two)), 2 * per_mean);
  }
}

TEST_F(TouchByTouchTest, AveragesALargeArray) {
  // 900 elements tell planes apart by hundreds of nats, floor or not.
  const Recording large = random_recording(1, 900, 74);
  const Touch touch = large.touch(0);
  for (const double gamma : {0.1, 1e-6}) {
    HistogramOptions options{
        .lattice = {.x_mm = {-3.0, 3.0, 9}, .y_mm = {-3.0, 3.0, 8}, .theta_rad = {0, two_pi, 16}},
        .touch_sd = {.mm = 1.0, .rad = 0.2}};
    options.contact.gamma = gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, two_maps(), options);
    histogram.update(touch);
    // Rounding of a touch's own likelihood grows with its elements, 1e-4 nats for 36.
    EXPECT_LT(likelihood_error(histogram, expected_posterior(options, std::span(&touch, 1))),
              per_mean + 1e-4 * 900.0 / 36.0);
  }
}

TEST_F(TouchByTouchTest, SlipsAsTheReferenceDoes) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    HistogramOptions options{.lattice = c.lattice, .slip_sd = c.sd};
    options.contact.gamma = c.gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, two_maps(), options);
    histogram.update(touches);
    const reference::Posterior expected = expected_posterior(options, touches);
    // Without a floor, log-likelihoods are thousands of nats, of which float32 keeps 6 digits.
    EXPECT_LT(likelihood_error(histogram, expected),
              (c.gamma > 0.0 ? per_mean : 5e-3) * static_cast<double>(touches.size()));
    EXPECT_LT(largest_difference(histogram.estimate().identity, reference::identity(expected)),
              1e-3);
  }
}

TEST_F(TouchByTouchTest, SlippingSaysNothingAboutTheObject) {
  HistogramOptions options{.lattice = small_lattice(), .slip_sd = {.mm = 1.0, .rad = 0.2}};
  PoseHistogram histogram(device, two_maps(), options);
  PoseHistogram at_rest(device, two_maps(), {.lattice = options.lattice});
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

TEST_F(TouchByTouchTest, TakesUncertaintySlipAndNoneTogether) {
  for (const double gamma : {0.1, 0.0}) {
    HistogramOptions options{.lattice = small_lattice(),
                             .none_weight = 3.0,
                             .touch_sd = {.mm = 0.8, .rad = 0.1},
                             .slip_sd = {.mm = 0.7, .rad = 0.3}};
    options.contact.gamma = gamma;
    options.contact.prior = 0.2;
    PoseHistogram histogram(device, two_maps(), options);
    histogram.update(touches);
    EXPECT_LT(likelihood_error(histogram, expected_posterior(options, touches)),
              (gamma > 0.0 ? per_mean : 5e-3) * static_cast<double>(touches.size()));
  }
}

TEST_F(TouchByTouchTest, ForgetsAtAReset) {
  const HistogramOptions options{.lattice = small_lattice(),
                                 .none_weight = 1.0,
                                 .touch_sd = {.mm = 0.8, .rad = 0.1},
                                 .slip_sd = {.mm = 0.7, .rad = 0.3}};
  PoseHistogram histogram(device, two_maps(), options);
  const auto told = [&] {
    histogram.update(touches);
    return std::pair(histogram.log_likelihood(1), histogram.estimate().none);
  };
  const auto first = told();
  histogram.reset();
  EXPECT_EQ(told(), first);
}

TEST_F(TouchByTouchTest, TakesAnArrayThatChanges) {
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
      .lattice = small_lattice(), .none_weight = 1.0, .touch_sd = {.mm = 0.8, .rad = 0.1}};
  options.contact.prior = 0.2;
  PoseHistogram histogram(device, two_maps(), options);
  histogram.update(changing);
  const std::vector<std::vector<Logs>> by_touch = reference_touches(options, changing);
  const double allowed = per_mean * static_cast<double>(changing.size());
  EXPECT_LT(likelihood_error(histogram, expected_posterior(options, by_touch)), allowed);
  EXPECT_NEAR(log_odds_of_none(histogram), expected_log_odds_of_none(options, changing, by_touch),
              allowed);
}

TEST_F(TouchByTouchTest, RefusesWhatALatticeDoesNotTake) {
  const auto refuse = [&](const DisplacementSd& sd) {
    EXPECT_THROW(PoseHistogram(device, two_maps(), {.lattice = small_lattice(), .touch_sd = sd}),
                 Error);
    EXPECT_THROW(PoseHistogram(device, two_maps(), {.lattice = small_lattice(), .slip_sd = sd}),
                 Error);
  };
  refuse({.mm = -1.0});
  refuse({.rad = std::nan("")});
  refuse({.mm = 30.0});
}

}  // namespace palpate::touch_by_touch_test
