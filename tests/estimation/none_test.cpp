// "None of these", and touches that contradict everything. That "none of these" has the evidence of
// its definition is a law of filter_laws_test.cpp.

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "beliefs.hpp"
#include "made_up_sensors.hpp"
#include "palpate/particle_filter.hpp"
#include "palpate/pose_histogram.hpp"
#include "support/synthetic.hpp"

namespace palpate::none_test {

class NoneOfThese : public testing::Test {
 protected:
  PoseHistogram histogram_of(std::optional<double> none_weight) {
    return {shared_device(), objects, {.lattice = small_lattice(), .none_weight = none_weight}};
  }

  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 1.0, 151), 1.5},
                                        {random_map(25, 25, 0.5, 1.0, 152), 0.5}};
  const Recording recording = random_recording(3, 36, 165);
};

TEST_F(NoneOfThese, ChangesWithNoTouchOfUnknownElements) {
  // Vulkan's exp(), which the device sums, is exact to a few units of float32's last place.
  constexpr double exp_error = 1e-6;
  const std::vector<std::uint8_t> dead(36, 0);
  Touch silent = recording.touch(0);
  silent.T_robot_sensor = {{17.0, 1.0}, 0.3};  // where the array overlaps the objects at some bins
  silent.valid = dead;
  PoseHistogram histogram = histogram_of(2.0);
  PoseHistogram without = histogram_of(2.0);
  histogram.update(silent);
  EXPECT_NEAR(histogram.estimate().none, 0.5, exp_error);
  for (const Touch& touch : all_touches(recording)) {
    histogram.update(touch);
    histogram.update(silent);
    without.update(touch);
  }
  EXPECT_NEAR(histogram.estimate().none, without.estimate().none, exp_error);
}

TEST_F(NoneOfThese, LeavesSamplesOfTheObjectsWhereItTakesAllOfTheMass) {
  // Weights of 1e300 alone leave the objects 1e-300; touches that share no object do the rest.
  PoseHistogram histogram = histogram_of(1e300);
  PoseHistogram without = histogram_of({});
  for (int round = 0; round < 8; ++round) {
    histogram.update(all_touches(recording));
    without.update(all_touches(recording));
  }
  ASSERT_EQ(histogram.estimate().none, 1.0);
  EXPECT_EQ(without.estimate().none, 0.0);
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

TEST_F(NoneOfThese, IsNamedWhereTheObjectsNumbersLieFarApart) {
  // exp(799) is beyond float64: a mean relative to the first object's number would be infinite.
  ContactModel contact = random_table(2);
  std::vector<double>& numbers = contact.table->log_likelihood;
  std::fill_n(numbers.begin(), numbers.size() / 2, -800.0);
  PoseHistogram histogram(shared_device(), objects,
                          {.lattice = small_lattice(), .contact = contact, .none_weight = 1.0});
  histogram.update(recording.touch(0));
  const Estimate estimate = histogram.estimate();
  EXPECT_TRUE(estimate.none > 0.0 && estimate.none < 1.0) << estimate.none;
  EXPECT_EQ(estimate.identity[0], 0.0);
  EXPECT_FALSE(estimate.contradicted);
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

TEST(Contradiction, IsSaidWhereNothingExplainsTheTouches) {
  Recording recording;
  recording.elements_mm = {{-1, 0}, {1, 0}};
  recording.T_robot_sensor = {{}};
  HistogramOptions options{.lattice = small_lattice(), .none_weight = 1.0};
  for (const double gamma : {0.0, 0.1}) {
    options.contact.gamma = gamma;
    PoseHistogram histogram(shared_device(), sure_objects(), options);
    EXPECT_FALSE(histogram.estimate().contradicted) << "before any touch";
    // Half of the elements in contact, half not: neither full nor empty.
    recording.pressure = {9.0, 0.0};
    histogram.update(all_touches(recording));
    const Estimate estimate = histogram.estimate();
    EXPECT_EQ(estimate.contradicted, gamma == 0.0) << "else readings may be random";
    // A piece of an object explains the touch no better. float32 keeps 1e-4 of 1,000 nats.
    EXPECT_NEAR(estimate.none, 1.0 / 3.0, 1e-3);
    EXPECT_NEAR(estimate.mode.log_likelihood, gamma == 0.0 ? -1000.0 : 0.0, 5.0);
    histogram.reset();
    EXPECT_FALSE(histogram.estimate().contradicted);
    recording.pressure = {9.0, 9.0};
    histogram.update(all_touches(recording));
    EXPECT_FALSE(histogram.estimate().contradicted) << "the full one explains it";
  }
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
  const Recording recording = random_recording(8, 36, 158);
  const auto said = [&](double steepness, double gamma) {
    // So wide that no particle leaves its elements on what was never seen.
    const std::vector<Hypothesis> objects{{random_map(121, 121, 0.5, steepness, 159), 1.0},
                                          {random_map(121, 121, 0.5, steepness, 160), 1.0}};
    ParticleOptions options{.particles = 500, .region = {}};
    options.contact.gamma = gamma;
    ParticleFilter filter(shared_device(), objects, options);
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
