#include "learning/sensor_gain.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

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

std::vector<double> losses_of(std::span<const HeldOut> all) {
  std::vector<double> of_each;
  for (const HeldOut& press : alone(all)) {
    of_each.push_back(-press.log_evidence[press.truth]);
  }
  return of_each;
}

SensorGain gain_of(std::span<const HeldOut> eq7, std::span<const HeldOut> tempered) {
  std::vector<double> losses_before;
  for (const HeldOut& press : alone(eq7)) {
    const double p = press_probabilities(press, 1.0)[press.truth];
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
  bool costs =
      is_clearly_less(losses_before, losses) && gain.log_loss > gain.log_loss_before + small_nats;
  if (!errors.empty()) {
    gain.error_mm_before = std::exp(mean_of(errors_before));
    gain.error_mm = std::exp(mean_of(errors));
    gain.less_error = difference_of(errors, errors_before);
    gain.gains = gain.gains || gain.less_error.is_clear();
    constexpr double small_share = 0.1;
    costs = costs || (is_clearly_less(errors_before, errors) &&
                      *gain.error_mm > (1.0 + small_share) * *gain.error_mm_before);
  }
  gain.better = gain.gains && !costs;
  return gain;
}

}  // namespace palpate
