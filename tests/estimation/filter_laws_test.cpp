// What every filter promises, for every case of likelihood_cases.hpp: it agrees with float64, is
// the same touch by touch and after an update that was broken off, and moves with the robot frame.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>

#include <gtest/gtest.h>

#include "beliefs.hpp"
#include "likelihood_cases.hpp"
#include "palpate/error.hpp"
#include "support/limits.hpp"

namespace palpate::filter_laws_test {

/// The device of a case.
template <class Case>
class Laws : public testing::TestWithParam<Case> {
 protected:
  Laws() {
    if (of.lower) {
      own_.emplace(lowered_device(of.lower));
    }
  }
  Device& device() { return own_ ? *own_ : shared_device(); }

  const Case& of = this->GetParam();
  const std::vector<Touch> touches = all_touches(of.recording);

 private:
  std::optional<Device> own_;
};

template <class Filter>
void expect_the_same_however_updated(Filter& filter, const std::vector<Touch>& touches) {
  filter.update(touches);
  const auto at_once = all_answers(filter);

  filter.reset();
  std::vector<Touch> unsound{touches.front(), touches.back()};
  unsound.back().T_robot_sensor.theta_rad = nan;
  const std::size_t part = touches.size() / 100 + 1;  // a touch, where there are not too many
  for (std::size_t i = 0; i < touches.size(); i += part) {
    filter.update(std::span(touches).subspan(i, std::min(part, touches.size() - i)));
    (void)filter.estimate();
    EXPECT_THROW(filter.update(unsound), Error);
  }
  EXPECT_TRUE(all_answers(filter) == at_once) << "touch by touch, with refused touches between";

  filter.reset();
  try {
    filter.update(touches, [](double) { throw std::runtime_error("broken off"); });
  } catch (const std::runtime_error&) {
    EXPECT_THROW(filter.update(touches), Error) << "before reset()";
  }
  filter.reset();
  filter.update(touches);
  EXPECT_TRUE(all_answers(filter) == at_once) << "after an update that was broken off";
}

/// Expects sums over bins to be those of the expected posterior, within so many nats.
void expect_reductions(const PoseHistogram& histogram, const reference::Posterior& expected,
                       double nats) {
  // An error of e nats changes a probability p by at most 2 e p. Sums are of float32 parts of at
  // most 512 terms.
  const double relative = 2.0 * nats + 3e-5;
  const Estimate estimate = histogram.estimate();
  std::vector<double> identity = estimate.identity;
  double total = 0.0;
  for (double& p : identity) {
    total += p;
    p /= 1.0 - estimate.none;
  }
  EXPECT_NEAR(total + estimate.none, 1.0, 1e-14) << "rounding";
  EXPECT_LT(largest_difference(identity, reference::identity(expected)), relative);

  const auto& [object, bin, T_object_robot, log_likelihood] = estimate.mode;
  const reference::Mode mode = reference::mode(expected);
  const auto log_posterior = [&](int i, std::int64_t k) {
    return std::log(expected.weight[i]) + expected.log_likelihood[i][k];
  };
  EXPECT_NEAR(log_posterior(object, bin.value()), log_posterior(mode.object, mode.bin), 2.0 * nats);
  EXPECT_NEAR(log_likelihood, expected.log_likelihood[object][*bin], nats);
  const Pose pose = reference::bin_pose(expected.lattice, *bin);
  EXPECT_NEAR(T_object_robot.theta_rad, pose.theta_rad, 1e-12) << "float64 rounding";
  EXPECT_NEAR(T_object_robot.translation_mm.x, pose.translation_mm.x, 1e-9);
  EXPECT_NEAR(T_object_robot.translation_mm.y, pose.translation_mm.y, 1e-9);

  std::vector<double> logs;
  for (int i = 0; i < static_cast<int>(expected.weight.size()); ++i) {
    const auto near = [&](std::span<const double> p, const std::vector<double>& of_reference) {
      const double sum = std::accumulate(p.begin(), p.end(), 0.0);
      EXPECT_NEAR(sum, estimate.identity[i], 1e-6 + 3e-5 * sum);
      std::vector<double> share(p.begin(), p.end());
      for (double& s : share) {
        s /= 1.0 - estimate.none;
      }
      EXPECT_LE(largest_difference(share, of_reference), relative * std::ranges::max(of_reference));
    };
    const Marginals marginals = histogram.marginals(i);
    near(marginals.xy, reference::marginal_xy(expected, i));
    near(marginals.theta, reference::marginal_theta(expected, i));
    for (const double l : histogram.log_likelihood(i)) {
      logs.push_back(std::log(expected.weight[i]) + l);
    }
  }
  const double most = std::ranges::max(logs);
  double sum = 0.0;
  double weighted = 0.0;
  for (const double l : logs) {
    sum += std::exp(l - most);
    weighted += std::exp(l - most) * (l - most);
  }
  EXPECT_NEAR(histogram.entropy(), std::log(sum) - weighted / sum, 1e-4) << "sums of float32";
}

using HistogramLaws = Laws<LikelihoodCase>;

/// By how many nats a bin may differ from these log-likelihoods, [object][bin].
double allowed_nats(const LikelihoodCase& of, const std::vector<std::vector<double>>& expected) {
  double most = 0.0;
  for (const std::vector<double>& logs : expected) {
    most = std::max(most, -std::ranges::min(logs));
  }
  return of.nats * static_cast<double>(of.recording.size()) + of.share * most;
}

TEST_P(HistogramLaws, AgreesWithFloat64) {
  for (const PoseLattice& lattice : of.lattices) {
    SCOPED_TRACE(testing::Message() << lattice.x_mm.step() << " x " << lattice.y_mm.step()
                                    << " mm x " << lattice.theta_rad.step());
    HistogramOptions options = of.options;
    options.lattice = lattice;
    PoseHistogram histogram(device(), of.objects, options);
    EXPECT_NE(histogram.paths().front().find(of.path), std::string::npos)
        << histogram.paths().front();
    EXPECT_TRUE(of.paths == 0 || histogram.paths().size() == of.paths);
    EXPECT_EQ(histogram.estimate().mode.bin, 0) << "the first of equals";
    histogram.update(touches);
    const reference::Posterior expected = reference_posterior(of.objects, options, touches);
    const double nats = allowed_nats(of, expected.log_likelihood);
    EXPECT_LT(likelihood_error(histogram, expected), nats);
    expect_reductions(histogram, expected, nats);
    if (of.lower) {  // poses of the last slabs are refined as those of the only one
      PoseHistogram in_one(shared_device(), of.objects, options);
      in_one.update(touches);
      const Mode mode{.object = static_cast<int>(of.objects.size()) - 1, .bin = lattice.bins() / 2};
      const Pose pose = histogram.refine(mode).T_object_robot;
      const Pose expected_pose = in_one.refine(mode).T_object_robot;
      // 1e-4 nats move a mean within 2.5 mm by at most some 1e-3 mm.
      EXPECT_NEAR(pose.translation_mm.x, expected_pose.translation_mm.x, 10.0 * nats);
      EXPECT_NEAR(pose.theta_rad, expected_pose.theta_rad, 10.0 * nats);
    }
    if (options.none_weight) {
      EXPECT_NEAR(log_odds_of_none(histogram),
                  expected_log_odds_of_none(of.objects, options, touches), nats);
    }
  }
}

TEST_P(HistogramLaws, IsTheSameHoweverUpdated) {
  for (const PoseLattice& lattice : of.lattices) {
    HistogramOptions options = of.options;
    options.lattice = lattice;
    PoseHistogram histogram(device(), of.objects, options);
    expect_the_same_however_updated(histogram, touches);
  }
}

TEST_P(HistogramLaws, MovesWithTheRobotFrame) {
  const Pose T_moved_robot{{700.0, -714.0}, 0.9};
  const Recording elsewhere = moved(of.recording, T_moved_robot);
  HistogramOptions options = of.options;
  options.lattice = of.lattices.back();
  PoseHistogram here(device(), of.objects, options);
  here.update(touches);
  options.lattice.pivot_mm = T_moved_robot * options.lattice.pivot_mm;
  options.lattice.theta_rad.lower -= T_moved_robot.theta_rad;
  options.lattice.theta_rad.upper -= T_moved_robot.theta_rad;
  PoseHistogram there(device(), of.objects, options);
  there.update(all_touches(elsewhere));
  for (int object = 0; object < static_cast<int>(of.objects.size()); ++object) {
    const std::vector<double> logs = here.log_likelihood(object);
    EXPECT_LT(largest_difference(there.log_likelihood(object), logs),
              2.0 * allowed_nats(of, {logs}));
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, HistogramLaws, testing::ValuesIn(histogram_cases()),
                         [](const auto& each) { return each.param.name; });

using ParticleLaws = Laws<ParticleCase>;

TEST_P(ParticleLaws, AgreesWithFloat64) {
  ParticleFilter filter(device(), of.objects, of.options);
  for (const Touch& touch : touches) {
    filter.update(touch);
    EXPECT_LT(weight_error(filter, touch, of.objects, of.options, of.stride), of.nats);
    double total = 0.0;
    double squares = 0.0;
    for (const double weight : weights_of(filter)) {
      total += weight;
      squares += weight * weight;
    }
    EXPECT_NEAR(total, 1.0, 1e-9) << "float64 sums";
    EXPECT_NEAR(filter.effective_sample_size(), 1.0 / squares, 1e-5 / squares)
        << "float32 sums within blocks";
    EXPECT_GE(filter.effective_sample_size(), 1.0);
    EXPECT_LE(filter.effective_sample_size(), of.options.particles);
  }
  const Estimate estimate = filter.estimate();
  EXPECT_NEAR(std::accumulate(estimate.identity.begin(), estimate.identity.end(), 0.0), 1.0, 1e-9);
  std::vector<double> identity(of.objects.size());
  for (const ParticleFilter::Particle& particle : filter.particles()) {
    identity[particle.object] += particle.weight;
  }
  EXPECT_LT(largest_difference(estimate.identity, identity), 1e-12);
  EXPECT_TRUE(std::isfinite(estimate.mode.log_likelihood));
  double evidence = 0.0;
  for (const double log_evidence : estimate.log_evidence) {
    evidence += std::exp(log_evidence);
  }
  for (std::size_t i = 0; i < of.objects.size(); ++i) {
    EXPECT_NEAR(std::exp(estimate.log_evidence[i]) / evidence, estimate.identity[i], 1e-9);
  }
}

TEST_P(ParticleLaws, IsTheSameHoweverUpdated) {
  ParticleFilter filter(device(), of.objects, of.options);
  expect_the_same_however_updated(filter, touches);
}

TEST_P(ParticleLaws, MovesWithTheRobotFrame) {
  // 1 km away a float64 is good to 1e-10 mm, which may round float32 elements otherwise: a touch
  // differs by what the device may, and by the same draws.
  const glm::dvec2 far_mm{1.2e6, -3.4e5};
  const Recording elsewhere = moved(of.recording, {far_mm, 0.0});
  ParticleFilter near(device(), of.objects, of.options);
  near.update(touches.front());
  ParticleOptions options = of.options;
  options.region.pivot_mm += far_mm;
  ParticleFilter far(device(), of.objects, options);
  far.update(elsewhere.touch(0));
  EXPECT_LT(largest_difference(weights_of(near), weights_of(far)), 2.0 * of.nats);
  const Estimate here = near.estimate();
  const Estimate there = far.estimate();
  EXPECT_LT(largest_difference(here.identity, there.identity), 2.0 * of.nats);
  const glm::dvec2 p_mm{3.0, 4.0};
  const glm::dvec2 apart =
      here.mode.T_object_robot * p_mm - there.mode.T_object_robot * (p_mm + far_mm);
  EXPECT_NEAR(apart.x, 0.0, 1e-6) << "the same grid point, in float64";
  EXPECT_NEAR(apart.y, 0.0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Cases, ParticleLaws, testing::ValuesIn(particle_cases()),
                         [](const auto& each) { return each.param.name; });

}  // namespace palpate::filter_laws_test
