#include "learning/held_out.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "estimation/log_sum.hpp"
#include "recognition/label_probability.hpp"

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

using StrangerFits = std::map<std::size_t, std::vector<StrangerFit>>;

/// The fits of one touch each, or of several, of objects with five or more, on a scale; none where
/// these are fewer than three objects.
std::vector<std::vector<StrangerFit>> counted(const StrangerFits& objects, const FitScale& scale,
                                              bool single_touches) {
  constexpr std::size_t enough = 5;
  constexpr std::size_t least_objects = 3;
  std::vector<std::vector<StrangerFit>> all;
  for (const auto& [label, fits] : objects) {
    std::vector<StrangerFit> own;
    for (const auto& [fit, touches] : fits) {
      if ((touches == 1) == single_touches) {
        own.push_back({scale.of(fit, touches), touches});
      }
    }
    if (own.size() >= enough) {
      all.push_back(std::move(own));
    }
  }
  return all.size() < least_objects ? std::vector<std::vector<StrangerFit>>{} : all;
}

/// Each object counts alike.
double log_density(const std::vector<std::vector<StrangerFit>>& objects, const FitScale& scale) {
  double sum = 0.0;
  for (const std::vector<StrangerFit>& fits : objects) {
    double of_object = 0.0;
    for (const auto& [fit, touches] : fits) {
      of_object += std::log(stranger_density(fit, touches, scale));
    }
    sum += of_object / static_cast<double>(fits.size());
  }
  return sum;
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

FitScale with_strangers(const StrangerFits& objects, FitScale scale) {
  constexpr double least_sd = 1.0;
  constexpr double most_sd = 16.0;
  constexpr double step = 1.05;
  constexpr double least_mean = -16.0;
  constexpr double mean_step = 0.5;
  scale.stranger_sd.reset();
  scale.stranger_single_touch.reset();
  const auto of_several = counted(objects, scale, false);
  const auto of_one = counted(objects, scale, true);
  FitScale tried = scale;
  double likeliest_sd = -std::numeric_limits<double>::infinity();
  double likeliest_single = likeliest_sd;
  for (double sd = least_sd; sd <= most_sd; sd *= step) {
    tried.stranger_sd = sd;
    if (const double nats = log_density(of_several, tried);
        !of_several.empty() && nats > likeliest_sd) {
      likeliest_sd = nats;
      scale.stranger_sd = sd;
    }
    for (double mean = 0.0; mean >= least_mean && !of_one.empty(); mean -= mean_step) {
      tried.stranger_single_touch = {mean, sd};
      if (const double nats = log_density(of_one, tried); nats > likeliest_single) {
        likeliest_single = nats;
        scale.stranger_single_touch = tried.stranger_single_touch;
      }
    }
  }
  return scale;
}

std::string unlearned_strangers(const LearnedSensor& sensor) {
  const bool known_poses = sensor.bins.has_value();
  if (!sensor.fit_scale || (known_poses ? sensor.fit_scale->stranger_sd.has_value()
                                        : sensor.fit_scale->stranger_single_touch.has_value())) {
    return "";
  }
  return known_poses ? "\"(none)\" goes by a figure of Palpate's own for how badly strangers fit; "
                       "to learn it, give 15 touches or more of each of three objects"
                     : "how badly strangers fit is not learned, so that a press does not tell "
                       "\"(none)\"; give presses of three objects or more";
}

}  // namespace palpate
