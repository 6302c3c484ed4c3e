#include "support/certified.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <string>

#include <gtest/gtest.h>

namespace palpate {

namespace {

/// log of every prior weight over their sum.
std::vector<double> log_prior(const std::vector<double>& weights) {
  const double largest = *std::max_element(weights.begin(), weights.end());
  double sum = 0.0;
  for (const double weight : weights) {
    sum += weight / largest;
  }
  std::vector<double> logs;
  for (const double weight : weights) {
    logs.push_back(std::log(weight) - std::log(largest) - std::log(sum));
  }
  return logs;
}

double distance(std::span<const double> a, std::span<const double> b) {
  EXPECT_EQ(a.size(), b.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += std::abs(a[i] - b[i]);
  }
  return sum / 2.0;
}

/// Entropy of objects and bins, in nats.
double entropy(const reference::Posterior& truth) {
  const std::vector<double> prior = log_prior(truth.weight);
  std::vector<double> logs;
  for (std::size_t i = 0; i < prior.size(); ++i) {
    for (const double nats : truth.log_likelihood[i]) {
      logs.push_back(prior[i] + nats);
    }
  }
  const double log_total = log_sum(logs);
  double sum = 0.0;
  for (const double log : logs) {
    sum -= std::exp(log - log_total) * (log - log_total);
  }
  return sum;
}

/// The mass of the places that `estimated` gives nothing.
double mass_of_zeros(std::span<const double> truth, std::span<const double> estimated) {
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum += estimated[i] == 0.0 ? truth[i] : 0.0;
  }
  return sum;
}

}  // namespace

reference::Posterior reference_posterior(std::span<const Hypothesis> objects,
                                         const BoundedOptions& options,
                                         std::span<const Touch> touches) {
  return reference_posterior(
      objects,
      HistogramOptions{
          .lattice = options.lattice, .contact = options.contact, .touch_sd = options.touch_sd},
      touches);
}

namespace {

/// Bounds of the log evidence of all hypotheses that bear a label.
std::map<std::string, LogInterval> label_evidence(std::span<const Hypothesis> objects,
                                                  const Certificate& certificate) {
  std::map<std::string, LogInterval> labels;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const LogInterval& own = certificate.log_evidence[i];
    const auto [at, first] = labels.try_emplace(objects[i].map.label, own);
    if (!first) {
      at->second = {log_sum(std::array{at->second.low, own.low}),
                    log_sum(std::array{at->second.high, own.high})};
    }
  }
  return labels;
}

}  // namespace

Certified expect_certified(const BoundedPosterior& posterior, std::span<const Hypothesis> objects,
                           const BoundedOptions& options, const reference::Posterior& truth,
                           double nats) {
  Certified seen{.estimate = posterior.estimate()};
  const Estimate& estimate = seen.estimate;
  const std::vector<double> prior = log_prior(truth.weight);
  const std::vector<double> identity = reference::identity(truth);
  if (!estimate.certificate || estimate.identity.size() != objects.size() ||
      estimate.identity_bounds.size() != objects.size() ||
      estimate.certificate->log_evidence.size() != objects.size() || !estimate.mode.bin) {
    ADD_FAILURE() << "no certificate, bounds or bin for every object";
    return seen;
  }
  const Certificate& certificate = *estimate.certificate;
  const double allowed = certificate.dropped_mass + 2.0 * nats + 1e-14;

  EXPECT_GE(certificate.dropped_mass, 0.0);
  EXPECT_LE(certificate.dropped_mass, options.budget_s ? 1.0 : options.tolerance + 2.0 * nats);
  EXPECT_NEAR(std::accumulate(estimate.identity.begin(), estimate.identity.end(), estimate.none),
              1.0, 1e-12);
  EXPECT_GE(certificate.bins_evaluated, 0);  // bins that no element sees need not be evaluated
  EXPECT_GE(certificate.blocks_bounded, 0);

  double top = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < objects.size(); ++i) {
    SCOPED_TRACE(::testing::Message() << "object " << i);
    const std::vector<double>& logs = truth.log_likelihood[i];
    top = std::max(top, prior[i] + *std::max_element(logs.begin(), logs.end()));
    const double evidence = prior[i] + log_sum(logs);
    const auto [low_nats, high_nats] = certificate.log_evidence[i];
    EXPECT_LE(low_nats, evidence + nats);
    EXPECT_GE(high_nats, evidence - nats);

    const double p = estimate.identity[i];
    const auto [low, high] = estimate.identity_bounds[i];
    EXPECT_TRUE(0.0 <= low && low <= p && p <= high && high <= 1.0 + 1e-14)
        << low << ", " << p << ", " << high;
    const double slack = 2.0 * nats * identity[i] + 1e-15;
    EXPECT_LE(low, identity[i] + slack);
    EXPECT_GE(high, identity[i] - slack);
    seen.identity_error = std::max(seen.identity_error, std::abs(p - identity[i]));
  }
  for (const auto& [label, interval] : label_evidence(objects, certificate)) {
    SCOPED_TRACE(::testing::Message() << "label '" << label << "'");
    seen.widest_nats = std::max(seen.widest_nats, interval.high - interval.low);
    if (options.evidence_nats && !options.budget_s &&
        interval.high > top - options.evidence_range_nats) {
      EXPECT_LE(interval.high - interval.low, *options.evidence_nats);
    }
  }
  EXPECT_LE(seen.identity_error, allowed);
  seen.total_variation = distance(estimate.identity, identity);

  double by_xy = 0.0;
  double by_theta = 0.0;
  double left_out = 0.0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const auto [grid, xy, theta] = posterior.marginals(static_cast<int>(i));
    const std::vector<double> true_xy = reference::marginal_xy(truth, static_cast<int>(i));
    by_xy += distance(xy, true_xy);
    by_theta += distance(theta, reference::marginal_theta(truth, static_cast<int>(i)));
    left_out += mass_of_zeros(true_xy, xy);
    const double p = estimate.identity[i];
    // Sums of float64, of logs that keep 16 digits.
    const double rounding = 1e-12 + 1e-15 * std::abs(estimate.mode.log_likelihood);
    EXPECT_NEAR(std::accumulate(xy.begin(), xy.end(), 0.0), p, rounding) << "object " << i;
    EXPECT_NEAR(std::accumulate(theta.begin(), theta.end(), 0.0), p, rounding) << "object " << i;
  }
  EXPECT_LE(left_out, allowed);
  seen.total_variation = std::max({seen.total_variation, by_xy, by_theta});
  EXPECT_LE(seen.total_variation, allowed);

  if (!options.budget_s && options.tolerance <= 1e-3) {
    // The dropped mass, times the log of the bins and how far below the others they may be.
    EXPECT_NEAR(posterior.entropy(), entropy(truth), 1e-9 + 100.0 * allowed);
  }

  const auto object = static_cast<std::size_t>(estimate.mode.object);
  const double at_mode = truth.log_likelihood[object][static_cast<std::size_t>(*estimate.mode.bin)];
  EXPECT_NEAR(estimate.mode.log_likelihood, at_mode, nats);
  if (!options.budget_s || certificate.mode_certain) {
    EXPECT_GE(prior[object] + at_mode, top - 2.0 * nats) << "not the best bin";
  }
  Uniform random(17);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const auto bin =
          static_cast<std::size_t>(random(0.0, static_cast<double>(options.lattice.bins())));
      const Pose pose = reference::bin_pose(options.lattice, static_cast<std::int64_t>(bin));
      const double log_likelihood = posterior.log_likelihood(static_cast<int>(i), pose);
      EXPECT_NEAR(log_likelihood, truth.log_likelihood[i][bin], nats);
    }
  }
  return seen;
}

Certified expect_certified(std::span<const Hypothesis> objects, const BoundedOptions& options,
                           std::span<const Touch> touches, double nats) {
  BoundedPosterior posterior(objects, options);
  posterior.update(touches);
  BoundedOptions grown = options;  // what the options ask for after these touches
  if (options.evidence_nats && touches.size() > 1) {
    const double times = 1.0 + options.evidence_growth * static_cast<double>(touches.size() - 1);
    *grown.evidence_nats *= times;
    grown.evidence_range_nats *= times;
  }
  return expect_certified(posterior, objects, grown, reference_posterior(objects, options, touches),
                          nats);
}

namespace {

struct Cancelled {};

/// Expects a search to end at any cancel point, of many at nine of them, and the next call to tell
/// the same as without.
void expect_the_same_after_a_cancel(std::span<const Hypothesis> objects, BoundedOptions options,
                                    std::span<const Touch> touches,
                                    const std::vector<std::vector<double>>& told) {
  int passed = 0;
  int last = -1;
  options.cancel_point = [&] {
    if (passed++ == last) {
      throw Cancelled();
    }
  };
  BoundedPosterior posterior(objects, options);
  posterior.update(touches);
  posterior.estimate();
  const int points = passed;  // 0 where no element sees a map, and nothing is searched
  for (int point = 0; point < points; point += 1 + points / 9) {
    posterior.reset();
    posterior.update(touches);
    passed = 0;
    last = point;
    EXPECT_THROW(posterior.estimate(), Cancelled) << "at cancel point " << point;
    last = -1;
    EXPECT_EQ(all_answers(posterior, objects.size()), told) << "cancelled at point " << point;
  }
}

}  // namespace

std::vector<Certified> expect_laws(std::span<const Hypothesis> objects,
                                   const BoundedOptions& options, const Recording& recording,
                                   double nats) {
  const std::vector<Touch> touches = all_touches(recording);
  const std::size_t count = objects.size();
  const bool certified = !options.none_weight;
  BoundedPosterior posterior(objects, options);
  const auto untouched = all_answers(posterior, count);
  reference::Posterior truth = reference_posterior(objects, options, {});
  std::vector<Certified> seen;
  const auto look = [&] {
    if (certified) {
      SCOPED_TRACE(::testing::Message() << seen.size() << " touches");
      seen.push_back(expect_certified(posterior, objects, options, truth, nats));
    }
  };
  look();
  for (const Touch& touch : touches) {
    posterior.update(touch);
    const reference::Posterior of_touch =
        reference_posterior(objects, options, std::span(&touch, 1));
    for (std::size_t i = 0; i < count; ++i) {
      std::ranges::transform(truth.log_likelihood[i], of_touch.log_likelihood[i],
                             truth.log_likelihood[i].begin(), std::plus());
    }
    look();
  }
  const auto told = all_answers(posterior, count);
  EXPECT_EQ(all_answers(posterior, count), told) << "asked again";
  posterior.reset();
  EXPECT_EQ(all_answers(posterior, count), untouched) << "after a reset";
  posterior.update(touches);
  posterior.reset();  // of touches that nothing has asked about
  posterior.update(touches);
  EXPECT_EQ(all_answers(posterior, count), told) << "all at once, after a reset";

  BoundedOptions on_one_thread = options;
  on_one_thread.threads = 1;
  BoundedPosterior another_order(objects, on_one_thread);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    another_order.update(touches[i == 0 ? 0 : touches.size() - i]);
    another_order.sample(3, i);
  }
  EXPECT_EQ(all_answers(another_order, count), told) << "in another order, on one thread";
  expect_the_same_after_a_cancel(objects, options, touches, told);

  const Pose T_moved_robot{{31.0, -17.0}, 0.9};
  BoundedOptions in_moved = options;
  in_moved.lattice.pivot_mm = T_moved_robot * options.lattice.pivot_mm;
  in_moved.lattice.theta_rad.lower -= T_moved_robot.theta_rad;
  in_moved.lattice.theta_rad.upper -= T_moved_robot.theta_rad;
  if (certified) {
    SCOPED_TRACE("in a frame that has moved");
    const Recording there = moved(recording, T_moved_robot);
    BoundedPosterior moved_posterior(objects, in_moved);
    moved_posterior.update(all_touches(there));
    expect_certified(moved_posterior, objects, in_moved, truth, 2.0 * nats);
  }
  return seen;
}

std::vector<std::vector<double>> all_answers(const BoundedPosterior& posterior,
                                             std::size_t objects) {
  const Estimate estimate = posterior.estimate();
  const Certificate certificate = estimate.certificate.value();
  const RefinedPose refined = posterior.refine(estimate.mode);
  std::vector<std::vector<double>> told{
      estimate.identity,
      {estimate.none, certificate.none_log_evidence.value_or(LogInterval{}).low,
       certificate.none_log_evidence.value_or(LogInterval{}).high,
       static_cast<double>(estimate.contradicted), certificate.dropped_mass,
       static_cast<double>(certificate.mode_certain)},
      {static_cast<double>(estimate.mode.object), static_cast<double>(estimate.mode.bin.value()),
       estimate.mode.log_likelihood},
      {refined.T_object_robot.translation_mm.x, refined.T_object_robot.translation_mm.y,
       refined.T_object_robot.theta_rad},
      {refined.covariance.begin(), refined.covariance.end()},
      {posterior.entropy()}};
  for (std::size_t i = 0; i < objects; ++i) {
    const auto [grid, xy, theta] = posterior.marginals(static_cast<int>(i));
    told.push_back(xy);
    told.push_back(theta);
    told.push_back({estimate.identity_bounds[i].low, estimate.identity_bounds[i].high,
                    certificate.log_evidence[i].low, certificate.log_evidence[i].high,
                    posterior.log_likelihood(static_cast<int>(i), {{0.3, -0.7}, 1.1})});
  }
  return told;
}

}  // namespace palpate
