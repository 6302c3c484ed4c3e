#include "learning/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "estimation/log_sum.hpp"

namespace palpate {

namespace {

/// The logarithms of the pose errors: a group that is taken for another place of the object counts
/// no more than ten that are placed a little better.
std::vector<double> log_errors_of(std::span<const HeldOut> all) {
  constexpr double least_mm = 1e-3;  // no smaller error tells anything
  std::vector<double> errors;
  for (const HeldOut& one : all) {
    if (one.error_mm) {
      errors.push_back(std::log(std::max(*one.error_mm, least_mm)));
    }
  }
  return errors;
}

double mean_of(std::span<const double> numbers) {
  return std::accumulate(numbers.begin(), numbers.end(), 0.0) / static_cast<double>(numbers.size());
}

}  // namespace

std::vector<double> log_probabilities(const HeldOut& press, double temperature,
                                      double feature_weight) {
  std::vector<double> nats = press.log_evidence;
  LogSum sum;
  for (std::size_t i = 0; i < nats.size(); ++i) {
    nats[i] /= temperature;
    nats[i] += press.log_density.empty() ? 0.0 : feature_weight * press.log_density[i];
    sum.add(nats[i]);
  }
  const double log_sum = sum.log();
  for (double& x : nats) {
    x -= log_sum;
  }
  return nats;
}

Scores scores_of(std::span<const HeldOut> presses, double temperature, double feature_weight) {
  std::vector<JudgedRecord> records;
  for (const HeldOut& press : presses) {
    const std::vector<double> nats = log_probabilities(press, temperature, feature_weight);
    JudgedRecord record{.truth = std::to_string(press.truth)};
    for (std::size_t label = 0; label < nats.size(); ++label) {
      record.identity[std::to_string(label)] = std::exp(nats[label]);
    }
    record.best = std::to_string(std::ranges::max_element(nats) - nats.begin());
    records.push_back(std::move(record));
  }
  return evaluate(records).all;
}

std::vector<double> losses_of(std::span<const HeldOut> all) {
  std::vector<double> of_each;
  for (const HeldOut& press : single_touches(all)) {
    of_each.push_back(-press.log_evidence[press.truth]);
  }
  return of_each;
}

bool LossDifference::is_clear() const {
  constexpr double rounding = 1e-9;
  return mean > std::max(rounding, 2.0 * standard_error);
}

LossDifference difference_of(std::span<const double> losses, std::span<const double> others) {
  const auto n = static_cast<double>(losses.size());
  double mean = 0.0;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    mean += (others[i] - losses[i]) / n;
  }
  double variance = 0.0;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const double apart = others[i] - losses[i] - mean;
    variance += apart * apart / std::max(1.0, n - 1.0);
  }
  return {mean, std::sqrt(variance / n)};
}

SensorGain gain_of(std::span<const HeldOut> eq7, std::span<const HeldOut> tempered) {
  std::vector<double> losses_before;
  for (const HeldOut& press : single_touches(eq7)) {
    const double p = std::exp(log_probabilities(press, 1.0)[press.truth]);
    losses_before.push_back(-std::log(std::max(p, least_answer_probability)));
  }
  const std::vector<double> losses = losses_of(tempered);
  const std::vector<double> errors_before = log_errors_of(eq7);
  const std::vector<double> errors = log_errors_of(tempered);
  SensorGain gain{.log_loss_before = mean_of(losses_before),
                  .log_loss = mean_of(losses),
                  .less_loss = difference_of(losses, losses_before)};
  gain.gains = gain.less_loss.is_clear();
  constexpr double small_nats = 0.02;
  bool costs = difference_of(losses_before, losses).is_clear() &&
               gain.log_loss > gain.log_loss_before + small_nats;
  if (!errors.empty()) {
    gain.error_mm_before = std::exp(mean_of(errors_before));
    gain.error_mm = std::exp(mean_of(errors));
    gain.less_error = difference_of(errors, errors_before);
    gain.gains = gain.gains || gain.less_error.is_clear();
    constexpr double small_share = 0.1;
    costs = costs || (difference_of(errors_before, errors).is_clear() &&
                      *gain.error_mm > (1.0 + small_share) * *gain.error_mm_before);
  }
  gain.better = gain.gains && !costs;
  return gain;
}

}  // namespace palpate
