#include "learning/temperature_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "learning/local_search.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

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
  TemperatureFit of_evidence() const { return {.temperature = best_temperature(0.0, hottest)}; }

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
  static constexpr double coldest = 0.01;
  static constexpr double hottest = most_temperature;

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
        std::log(coldest), std::log(upper_bound),
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
