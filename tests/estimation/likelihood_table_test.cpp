// Tables in the place of Eq. 7, on every way that a likelihood takes.

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "gpu/context.hpp"
#include "palpate/error.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "particles/weighed_particles.hpp"
#include "support/synthetic.hpp"

namespace palpate::likelihood_table_test {

// What the method allows a log-likelihood to differ from float64, in nats per touch of 36 elements.
constexpr double per_touch = 1e-4;
// The maps' log odds, as steep as this, lie within the tables' nodes.
constexpr double steepness = 12.0;
constexpr double node_step = 0.05;
// The second derivative of Eq. 7 in the log odds is at most 1, so that a straight line between two
// nodes is off by at most step^2 / 8.
constexpr double interpolation_nats = node_step * node_step / 8.0;

LikelihoodTable empty_table(std::vector<double> level_edges) {
  constexpr double end = 13.0;
  return {.first_log_odds = -end,
          .last_log_odds = end,
          .nodes = static_cast<std::size_t>(std::lround(2.0 * end / node_step)) + 1,
          .level_edges = std::move(level_edges),
          .log_likelihood = {}};
}

/// Eq. 7 at the nodes of a table.
ContactModel tabled(double gamma) {
  const ContactModel eq7{.gamma = gamma, .prior = 0.2};
  LikelihoodTable table = empty_table({});
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    for (std::size_t i = 0; i < table.nodes; ++i) {
      const double l = table.first_log_odds + node_step * static_cast<double>(i);
      table.log_likelihood.push_back(reference::log_likelihood(reading, {l}, eq7));
    }
  }
  return {.table = std::move(table)};
}

/// Random numbers for every object, and four levels of contact between 6 and 20 kPa.
ContactModel learned(std::size_t objects) {
  LikelihoodTable table = empty_table({8.0, 11.0, 15.0});
  Uniform random(71);
  for (std::size_t row = 0; row < objects * table.levels(); ++row) {
    // As smooth as counts of readings are.
    const double slope = random(-0.2, 0.2);
    for (std::size_t i = 0; i < table.nodes; ++i) {
      table.log_likelihood.push_back(-3.0 + slope * node_step * static_cast<double>(i) +
                                     random(-0.1, 0.1));
    }
  }
  return {.table = std::move(table)};
}

const std::vector<Hypothesis>& objects() {
  static const std::vector<Hypothesis> three{{random_map(31, 27, 0.5, steepness, 72), 1.0},
                                             {random_map(61, 61, 0.25, steepness, 73), 2.0},
                                             {random_map(23, 29, 0.5, steepness, 74), 1.0}};
  return three;
}

HistogramOptions options_of(double step_mm, ContactModel contact) {
  return {.lattice = {.x_mm = {-3.0, -3.0 + 11 * step_mm, 11},
                      .y_mm = {-2.0, -2.0 + 9 * step_mm, 9},
                      .theta_rad = {0.0, 3.0, 4}},
          .contact = std::move(contact)};
}

/// Presses of an array at rest, most of which reads No Contact.
Recording presses() {
  Recording recording = random_recording(3, 36, 75);
  recording.T_robot_sensor.assign(3, {{0.7, -0.4}, 0.3});
  for (std::size_t i = 0; i < recording.pressure.size(); ++i) {
    if (i % 36 != 0 && i % 4 != 0) {
      recording.pressure[i] = 0.0;
    }
  }
  return recording;
}

/// Every way of a touch into a histogram.
class EveryWay : public testing::Test {
 protected:
  /// Compares what three touches leave with the reference of `expected`'s model.
  void compare(const ContactModel& contact, const ContactModel& expected, double nats_per_touch) {
    // Register tiles over one and two cells, and runs of bins.
    for (const double step_mm : {0.1, 0.25, 0.8}) {
      const HistogramOptions options = options_of(step_mm, contact);
      const HistogramOptions other = options_of(step_mm, expected);
      const std::vector<Touch> moving = all_touches(moving_);
      const reference::Posterior of_moving = reference_posterior(objects(), other, moving);

      PoseHistogram histogram(device_, objects(), options);
      histogram.update(moving);
      EXPECT_LT(likelihood_error(histogram, of_moving), 3 * nats_per_touch) << step_mm << " mm";
    }
  }

  Device device_ = Device::open();
  Recording moving_ = random_recording(3, 36, 76);
};

TEST_F(EveryWay, GivesTheReferenceOfATable) {
  for (const double gamma : {0.1, 0.0}) {
    compare(tabled(gamma), tabled(gamma), per_touch);
  }
}

TEST_F(EveryWay, GivesEquation7FromATableOfIt) {
  // With a floor and without one.
  for (const double gamma : {0.1, 0.0}) {
    compare(tabled(gamma), {.gamma = gamma}, per_touch + 36 * interpolation_nats);
  }
}

TEST_F(EveryWay, TellsLevelsAndObjectsApart) {
  compare(learned(objects().size()), learned(objects().size()), per_touch);
  compare(learned(1), learned(1), per_touch);
}

TEST_F(EveryWay, ReadsMapsFromStorageBesideATable) {
  gpu::Limits limits = device_.context().limits();
  // Above the table's 3 sets of 10 rows of 521 nodes, and below the map's cells.
  limits.table_texels = 22'000;
  device_.context().lower_limits(limits);
  std::vector<Hypothesis> large = objects();
  large[1].map = random_map(160, 170, 0.1, steepness, 77);
  const std::vector<Touch> touches = all_touches(moving_);
  for (const double step_mm : {0.1, 0.8}) {
    const HistogramOptions options = options_of(step_mm, learned(large.size()));
    PoseHistogram histogram(device_, large, options);
    histogram.update(touches);
    EXPECT_LT(likelihood_error(histogram, reference_posterior(large, options, touches)),
              3 * per_touch);
  }
}

TEST_F(EveryWay, WeighsParticles) {
  const Touch touch = moving_.touch(0);
  for (const ContactModel& contact : {tabled(0.1), tabled(0.0), learned(1), learned(3)}) {
    const ParticleOptions options{.particles = 1000, .region = {}, .contact = contact};
    ParticleFilter filter(device_, objects(), options);
    filter.update(touch);
    EXPECT_LT(weight_error(filter, touch, objects(), options), per_touch);
  }
}

TEST_F(EveryWay, GivesNoneOfTheseTheMeanOverObjectsOfTheirOwnNumbers) {
  const ContactModel contact = learned(objects().size());
  HistogramOptions options = options_of(0.8, contact);
  options.none_weight = 2.0;
  PoseHistogram histogram(device_, objects(), options);
  const std::vector<Touch> touches = all_touches(moving_);
  histogram.update(touches);

  reference::Posterior expected = reference_posterior(objects(), options, touches);
  std::vector<std::vector<std::vector<double>>> by_touch;
  for (const Touch& touch : touches) {
    by_touch.push_back(
        reference_posterior(objects(), options, std::span(&touch, 1)).log_likelihood);
  }
  // Every bin of an object of nothing but "none of these" has its evidence.
  expected.log_likelihood.emplace_back(
      options.lattice.bins(),
      reference::none_log_evidence(touches, options.lattice, objects(), by_touch));
  expected.weight.push_back(2.0);
  // An error in nats changes a probability by at most as much, and a mean is off by 1e-3 nats.
  EXPECT_NEAR(histogram.estimate().none, reference::identity(expected).back(), 3e-3);
}

TEST_F(EveryWay, NamesNoneWhereTheObjectsNumbersLieFarApart) {
  // exp(799) is beyond float64: a mean relative to the first object's number would be infinite.
  ContactModel contact = learned(objects().size());
  LikelihoodTable& table = *contact.table;
  const std::size_t numbers = table.log_likelihood.size() / objects().size();
  std::fill_n(table.log_likelihood.begin(), numbers, -800.0);
  HistogramOptions options = options_of(0.8, contact);
  options.none_weight = 1.0;
  PoseHistogram histogram(device_, objects(), options);
  histogram.update(moving_.touch(0));
  const Estimate estimate = histogram.estimate();
  EXPECT_TRUE(estimate.none > 0.0 && estimate.none < 1.0) << estimate.none;
  EXPECT_EQ(estimate.identity[0], 0.0);
  EXPECT_FALSE(estimate.contradicted);
}

TEST_F(EveryWay, AddsManyShortSegmentsInOneUpdateAsInSeveral) {
  // 8 levels make up to 8 segments of one element or two in every touch. lavapipe ends an
  // invocation after 65,535 loop iterations, of which segments take their part.
  const ContactModel contact = learned(1);
  const Recording recording = random_recording(2500, 8, 77);
  const std::vector<Touch> touches = all_touches(recording);
  for (const double step_mm : {0.1, 0.8}) {
    PoseHistogram together(device_, objects(), options_of(step_mm, contact));
    together.update(touches);
    PoseHistogram apart(device_, objects(), options_of(step_mm, contact));
    for (std::size_t first = 0; first < touches.size(); first += 250) {
      apart.update(std::span(touches).subspan(first, 250));
    }
    EXPECT_EQ(together.log_likelihood(0), apart.log_likelihood(0)) << step_mm << " mm";
  }
}

TEST_F(EveryWay, RefusesATableOfOtherObjectsOrTooLargeForTheDevice) {
  const auto refuse = [&](const ContactModel& contact, const std::string& says) {
    try {
      const PoseHistogram histogram(device_, objects(), options_of(0.8, contact));
      ADD_FAILURE() << "accepted: " << says;
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::input);
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  };
  refuse(learned(2), "2 objects, but there are 3 maps");
  gpu::Limits limits = device_.context().limits();
  limits.table_texels = 7'500;  // of the 3 sets' 7,815
  device_.context().lower_limits(limits);
  refuse(learned(3), "use fewer nodes");
}

}  // namespace palpate::likelihood_table_test
