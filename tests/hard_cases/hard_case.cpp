#include "hard_case.hpp"

#include <algorithm>
#include <cmath>
#include <iostream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include "estimation/log_sum.hpp"

namespace palpate {

namespace {

// Error that the reductions add to a probability: float32 sums of at most 16,384 terms.
constexpr double reduction = 2e-6;

// Bins this many nats below the top hold one part in 1e9 of the mass.
constexpr double near_top_nats = 20.0;

std::string digits(double number) { return number == 0.0 ? "0" : fmt::format("{:.1e}", number); }

}  // namespace

double Allowed::at(double log_likelihood) const {
  return nats + relative * std::abs(log_likelihood);
}

HistogramOptions small_options() {
  return {.lattice = {{-5.0, 5.0, 5}, {-5.0, 5.0, 6}, {0.0, two_pi, 4}, {}}};
}

ParticleOptions two_thousand_particles(const glm::dvec2& pivot_mm) {
  return {.particles = 2000,
          .region = {{-5.0, 5.0, 1}, {-5.0, 5.0, 1}, {0, two_pi, 1}, pivot_mm},
          .seed = 501};
}

bool all_finite(std::span<const double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double n) { return std::isfinite(n); });
}

bool is_finite(const Pose& pose) {
  return all_finite(std::vector{pose.translation_mm.x, pose.translation_mm.y, pose.theta_rad});
}

void expect_finite(const RefinedPose& refined) {
  EXPECT_TRUE(is_finite(refined.T_object_robot));
  EXPECT_TRUE(all_finite(refined.covariance));
  for (const int i : {0, 4, 8}) {
    EXPECT_GE(refined.covariance[static_cast<std::size_t>(i)], 0.0);
  }
}

HardCase::~HardCase() {
  std::string seen;
  for (const auto& [quantity, largest] : largest_) {
    seen += fmt::format("{}{} {} of {}", seen.empty() ? "" : "; ", quantity, digits(largest.error),
                        digits(largest.allowed));
    testing::Test::RecordProperty(quantity, fmt::format("{:.3e}", largest.error));
  }
  std::cout << fmt::format("| {} | {} |", name_, seen.empty() ? "exact" : seen) << std::endl;
}

void HardCase::check(const std::string& quantity, double error, double allowed) const {
  EXPECT_LE(error, allowed) << name_ << ": " << quantity;
}

void HardCase::expect(const std::string& quantity, double error, double allowed) {
  check(quantity, error, allowed);
  Largest& largest = largest_[quantity];
  if (error * largest.allowed >= largest.error * allowed) {
    largest = {error, allowed};
  }
}

Estimate HardCase::expect_posterior(std::span<const Hypothesis> objects,
                                    const HistogramOptions& options, std::span<const Touch> touches,
                                    Allowed allowed, int times) {
  reference::Posterior expected = reference_posterior(objects, options, touches);
  for (auto& bins : expected.log_likelihood) {
    for (double& l : bins) {
      l *= times;
    }
  }
  PoseHistogram histogram(shared_device(), objects, options);
  for (int i = 0; i < times; ++i) {
    histogram.update(touches);
  }
  Estimate estimate = histogram.estimate();

  reference::Posterior product = expected;
  const auto log_posterior = [&](const reference::Posterior& posterior, std::size_t object,
                                 std::size_t bin) {
    return posterior.log_likelihood[object][bin] + std::log(objects[object].weight);
  };
  LogSum product_evidence;
  LogSum evidence;
  double top = -std::numeric_limits<double>::infinity();
  for (std::size_t object = 0; object < objects.size(); ++object) {
    product.log_likelihood[object] = histogram.log_likelihood(static_cast<int>(object));
    EXPECT_TRUE(all_finite(product.log_likelihood[object])) << name_ << ": object " << object;
    for (std::size_t bin = 0; bin < product.log_likelihood[object].size(); ++bin) {
      product_evidence.add(log_posterior(product, object, bin));
      evidence.add(log_posterior(expected, object, bin));
      top = std::max(top, log_posterior(expected, object, bin));
    }
  }
  const auto allowed_near_top = [&](double log_likelihood) {
    return allowed.near_top_nats.value_or(2.0 * allowed.at(log_likelihood));
  };
  for (std::size_t object = 0; object < objects.size(); ++object) {
    for (std::size_t bin = 0; bin < product.log_likelihood[object].size(); ++bin) {
      const double l = expected.log_likelihood[object][bin];
      const double error = product.log_likelihood[object][bin] - l;
      expect("log-likelihood, nats", std::abs(error), allowed.at(l));
      if (log_posterior(expected, object, bin) > top - near_top_nats) {
        expect("log posterior near the top, nats",
               std::abs(error - (product_evidence.log() - evidence.log())), allowed_near_top(l));
      }
    }
  }

  EXPECT_NEAR(sum(estimate.identity), 1.0, 1e-12) << name_;
  expect("identity", largest_difference(estimate.identity, reference::identity(expected)),
         allowed.identity);

  const auto object = static_cast<std::size_t>(estimate.mode.object);
  const auto bin = static_cast<std::size_t>(estimate.mode.bin.value());
  EXPECT_EQ(estimate.mode.log_likelihood, product.log_likelihood[object][bin]) << name_;
  check("mode below the best bin, nats", top - log_posterior(expected, object, bin),
        allowed_near_top(expected.log_likelihood[object][bin]));
  const Pose pose = reference::bin_pose(histogram.lattice(), *estimate.mode.bin);
  const glm::dvec2 shift = estimate.mode.T_object_robot.translation_mm - pose.translation_mm;
  EXPECT_LE(std::hypot(shift.x, shift.y), 1e-8) << name_;
  EXPECT_EQ(estimate.mode.T_object_robot.theta_rad, pose.theta_rad) << name_;

  expect_finite(histogram.refine(estimate.mode));
  for (int o = 0; o < static_cast<int>(objects.size()); ++o) {
    const auto [grid, xy, theta] = histogram.marginals(o);
    check("marginals", largest_difference(xy, reference::marginal_xy(expected, o)),
          allowed.marginal);
    check("marginals", largest_difference(theta, reference::marginal_theta(expected, o)),
          allowed.marginal);
    const double p = estimate.identity[static_cast<std::size_t>(o)];
    check("sum of marginals", std::abs(sum(xy) - p), reduction);
    check("sum of marginals", std::abs(sum(theta) - p), reduction);
  }
  return estimate;
}

Certified HardCase::expect_laws(std::span<const Hypothesis> objects, const BoundedOptions& options,
                                const Recording& recording, double nats) {
  SCOPED_TRACE(name_);
  const double allowed = options.tolerance + 2.0 * nats + 1e-14;
  std::vector<Certified> all = palpate::expect_laws(objects, options, recording, nats);
  for (const Certified& seen : all) {
    expect("identity", seen.identity_error, allowed);
    expect("total variation", seen.total_variation, allowed);
    if (seen.estimate.certificate) {
      expect("certificate", seen.estimate.certificate->dropped_mass, allowed);
    }
  }
  BoundedPosterior posterior(objects, options);
  posterior.update(all_touches(recording));
  expect_finite(posterior.refine(all.back().estimate.mode));
  return all.back();
}

Certified HardCase::expect_laws(std::span<const Hypothesis> objects,
                                const HistogramOptions& options, const Recording& recording,
                                double nats) {
  return expect_laws(objects,
                     BoundedOptions{.lattice = options.lattice, .contact = options.contact},
                     recording, nats);
}

ParticleFilter HardCase::expect_particles(std::span<const Hypothesis> objects,
                                          const ParticleOptions& options,
                                          const Recording& recording, double allowed_nats) {
  SCOPED_TRACE(name_);
  ParticleFilter filter(shared_device(), objects, options);
  for (const Touch& touch : all_touches(recording)) {
    filter.update(touch);
    const std::vector<ParticleFilter::Particle> particles = filter.particles();
    std::vector<double> expected;
    double all = 0.0;
    for (const ParticleFilter::Particle& particle : particles) {
      const OccupancyGrid& map = objects[static_cast<std::size_t>(particle.object)].map;
      EXPECT_TRUE(is_finite(particle.T_object_robot));
      expected.push_back(
          reference::log_likelihood(touch, particle.T_object_robot, map, options.contact));
      all += particle.weight;
    }
    EXPECT_NEAR(all, 1.0, 1e-12);
    // The largest error of the weights that are not negligible.
    const double most = *std::max_element(expected.begin(), expected.end());
    const std::vector<double> weights = reference::importance_weights(expected);
    double error = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (expected[i] > most - near_top_nats) {
        error = std::max(error, std::abs(std::log(particles[i].weight / weights[i])));
      }
    }
    expect("log weights near the top, nats", error, 2.0 * allowed_nats);
    EXPECT_GE(filter.effective_sample_size(), 1.0);
    EXPECT_LE(filter.effective_sample_size(), options.particles);
    const Estimate estimate = filter.estimate();
    EXPECT_NEAR(sum(estimate.identity), 1.0, 1e-12);
    EXPECT_TRUE(std::isfinite(estimate.mode.log_likelihood));
    EXPECT_TRUE(is_finite(estimate.mode.T_object_robot));
  }
  return filter;
}

OccupancyGrid HardCase::expect_map(std::span<const Touch> touches, const MapOptions& options) {
  MapBuilder builder(shared_device(), options);
  builder.add(touches);
  OccupancyGrid map = builder.build(name_);
  const std::vector<double> cells(map.log_odds.begin(), map.log_odds.end());
  EXPECT_TRUE(all_finite(cells)) << name_;
  const std::vector<double> expected =
      reference::log_odds_map(touches, map, options.classifier, options.sensor);
  for (std::size_t cell = 0; cell < cells.size(); ++cell) {
    const double allowed = std::max(1e-3, 1e-4 * std::abs(expected[cell]));
    expect("map, of what is allowed", std::abs(cells[cell] - expected[cell]) / allowed, 1.0);
  }
  return map;
}

}  // namespace palpate
