#include "learning/held_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "estimation/log_sum.hpp"
#include "learning/local_search.hpp"
#include "palpate/error.hpp"
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

namespace {

constexpr double least_temperature = 0.01;
constexpr double most_temperature = 1e6;

/// -log of the label's probability.
double loss_of(const HeldOut& press, double temperature, double feature_weight) {
  return -log_probabilities(press, temperature, feature_weight)[press.truth];
}

/// By how much one label's number exceeds the best other's.
double margin_of(std::span<const double> of_labels, std::size_t label) {
  double other = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < of_labels.size(); ++i) {
    other = i == label ? other : std::max(other, of_labels[i]);
  }
  return of_labels[label] - other;
}

/// Whether a press has two labels to choose from.
bool has_choice(const HeldOut& press) {
  return std::isfinite(margin_of(press.log_evidence, press.truth));
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The place of the least value of a function with one minimum over [lower, upper], within a
/// thousandth of the interval.
template <typename Function>
double least_place(double lower, double upper, const Function& function) {
  return least_at(lower, upper, 1e-3 * (upper - lower), function);
}

std::set<std::size_t> folds_in(std::span<const HeldOut> presses) {
  std::set<std::size_t> folds;
  for (const HeldOut& press : presses) {
    folds.insert(press.fold);
  }
  return folds;
}

/// The loss of presses. It is convex in the inverse of the temperature and the weight of the
/// features.
class PressLoss {
 public:
  explicit PressLoss(std::span<const HeldOut> presses) : presses_(presses) {
    std::vector<double> margins;
    std::vector<double> of_features;
    for (const HeldOut& press : presses) {
      if (!has_choice(press)) {
        continue;
      }
      margins.push_back(std::abs(margin_of(press.log_evidence, press.truth)));
      if (!press.log_density.empty()) {
        of_features.push_back(std::abs(margin_of(press.log_density, press.truth)));
      }
    }
    if (margins.empty()) {
      throw Error(Fault::input,
                  "temperature: presses of one object say nothing about confidence; give presses "
                  "of two objects or more");
    }
    margin_ = median(std::move(margins));
    if (std::ranges::none_of(presses,
                             [](const HeldOut& press) { return press.log_density.empty(); })) {
      feature_margin_ = median(std::move(of_features));
    }
  }

  bool has_features() const { return feature_margin_.has_value(); }

  /// The fit by the evidence alone.
  TemperatureFit of_evidence() const {
    return {.temperature = best_temperature(0.0, most_temperature)};
  }

  /// The fit by the evidence and the features.
  TemperatureFit of_both() const {
    const double by_evidence = of_evidence().temperature;
    // The least loss at each weight has one minimum along it.
    constexpr double most_weight = 2.0;
    const double weight = least_place(
        0.0, most_weight, [&](double w) { return loss(best_temperature(w, by_evidence), w); });
    return {.temperature = best_temperature(weight, by_evidence), .feature_weight = weight};
  }

 private:
  double loss(double temperature, double weight) const {
    double sum = of_even_press(margin_ / temperature);
    if (feature_margin_) {
      sum += of_even_press(weight * *feature_margin_);
    }
    for (const HeldOut& press : presses_) {
      sum += loss_of(press, temperature, weight);
    }
    return sum;
  }

  /// Log-loss of a press of two labels that is right or wrong with equal weights.
  static double of_even_press(double apart) { return apart / 2.0 + std::log1p(std::exp(-apart)); }

  double best_temperature(double weight, double upper_bound) const {
    return std::exp(least_place(
        std::log(least_temperature), std::log(upper_bound),
        [&](double log_temperature) { return loss(std::exp(log_temperature), weight); }));
  }

  std::span<const HeldOut> presses_;
  double margin_ = 0.0;
  std::optional<double> feature_margin_;
};

/// Whether the features' weight that the other folds show helps each fold's presses, all together.
bool features_help(std::span<const HeldOut> presses) {
  double gain = 0.0;
  for (const std::size_t fold : folds_in(presses)) {
    const std::vector<HeldOut> others = of_fold(presses, fold, false);
    if (!std::ranges::any_of(others, has_choice)) {
      continue;
    }
    const PressLoss loss(others);
    const TemperatureFit both = loss.of_both();
    const TemperatureFit evidence = loss.of_evidence();
    for (const HeldOut& press : of_fold(presses, fold, true)) {
      gain += loss_of(press, evidence.temperature, 0.0) -
              loss_of(press, both.temperature, both.feature_weight);
    }
  }
  return gain > 0.0;
}

double loss_of_groups(std::span<const HeldOut> groups, TemperatureFit fit, double growth) {
  fit.growth = growth;
  double sum = 0.0;
  for (const HeldOut& group : groups) {
    sum += loss_of(group, fit.temperature_after(group.touches), fit.feature_weight);
  }
  return sum;
}

/// The growth of the least loss, from 0, given the rest of the fit.
double least_growth(std::span<const HeldOut> groups, const TemperatureFit& fit) {
  // Where all groups have one size, the loss has one minimum along the growth's logarithm, as along
  // the temperature's.
  const double growth = std::exp(least_place(
      std::log(1e-3 * fit.temperature), std::log(most_temperature),
      [&](double log_growth) { return loss_of_groups(groups, fit, std::exp(log_growth)); }));
  return loss_of_groups(groups, fit, growth) < loss_of_groups(groups, fit, 0.0) ? growth : 0.0;
}

/// The growth that groups show, given the rest of the fit: 0 unless what each half of them shows
/// helps the other half, both taken together. A single group that is surely wrong, by a touch like
/// no other, is no growth.
double fit_growth(std::span<const HeldOut> all, const TemperatureFit& fit) {
  double gain = 0.0;
  for (std::size_t half = 0; half < 2; ++half) {
    const std::vector<HeldOut> other = of_half(all, 1 - half);
    gain += loss_of_groups(other, fit, 0.0) -
            loss_of_groups(other, fit, least_growth(of_half(all, half), fit));
  }
  return gain > 0.0 ? least_growth(groups_in(all), fit) : 0.0;
}

}  // namespace

TemperatureFit fit_temperature(std::span<const HeldOut> all) {
  const std::vector<HeldOut> presses = single_touches(all);
  if (presses.empty()) {
    throw Error(Fault::input, "calibration: no presses to try the model on; give more presses");
  }
  const PressLoss loss(presses);
  TemperatureFit fit =
      loss.has_features() && features_help(presses) ? loss.of_both() : loss.of_evidence();
  fit.growth = fit_growth(all, fit);
  return fit;
}

std::vector<HeldOut> tempered_by_folds(std::span<const HeldOut> all) {
  std::vector<HeldOut> tempered(all.begin(), all.end());
  const std::vector<HeldOut> presses = single_touches(all);
  for (const std::size_t fold : folds_in(presses)) {
    const std::vector<HeldOut> others = of_fold(presses, fold, false);
    TemperatureFit fit =
        fit_temperature(std::ranges::any_of(others, has_choice) ? others : presses);
    const std::array growth{least_growth(of_half(all, 1), fit), least_growth(of_half(all, 0), fit)};
    for (HeldOut& one : tempered) {
      if (one.fold == fold) {
        fit.growth = one.half ? growth.at(*one.half) : 0.0;
        one.log_evidence =
            log_probabilities(one, fit.temperature_after(one.touches), fit.feature_weight);
        one.log_density.clear();
      }
    }
  }
  return tempered;
}

}  // namespace palpate
