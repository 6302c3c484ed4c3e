#include "temperature_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "golden_section.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr double most_temperature = 1e6;

/// Logarithms of the labels' probabilities, before they are normalised.
std::vector<double> scores(const ScoredPress& press, double temperature, double feature_weight) {
  std::vector<double> nats = press.log_evidence;
  for (std::size_t i = 0; i < nats.size(); ++i) {
    nats[i] /= temperature;
    nats[i] += press.log_density.empty() ? 0.0 : feature_weight * press.log_density[i];
  }
  return nats;
}

double log_sum_exp(std::span<const double> nats) {
  const double largest = *std::ranges::max_element(nats);
  double sum = 0.0;
  for (const double x : nats) {
    sum += std::exp(x - largest);
  }
  return largest + std::log(sum);
}

/// -log of the label's probability.
double loss_of(const ScoredPress& press, double temperature, double feature_weight) {
  const std::vector<double> nats = scores(press, temperature, feature_weight);
  return log_sum_exp(nats) - nats[press.truth];
}

void require_sound(std::span<const ScoredPress> presses) {
  if (presses.empty()) {
    throw Error(Fault::input, "calibration: no presses to try the model on; give more presses");
  }
  const std::size_t labels = presses.front().log_evidence.size();
  const auto finite = [](double x) { return std::isfinite(x); };
  const auto below_infinity = [](double x) { return x < std::numeric_limits<double>::infinity(); };
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const ScoredPress& press = presses[i];
    if (press.log_evidence.size() != labels || press.truth >= labels ||
        (!press.log_density.empty() && press.log_density.size() != labels) ||
        !std::ranges::all_of(press.log_evidence, below_infinity) ||
        !std::isfinite(press.log_evidence[press.truth]) ||
        !std::ranges::all_of(press.log_density, finite)) {
      throw Error(Fault::input, fmt::format("calibration: press {}: give it a log evidence for "
                                            "each of {} labels, a finite one for its own",
                                            i, labels));
    }
  }
}

/// By how much the label's log evidence exceeds the best other's.
double margin_of(const ScoredPress& press) {
  double other = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < press.log_evidence.size(); ++i) {
    other = i == press.truth ? other : std::max(other, press.log_evidence[i]);
  }
  return press.log_evidence[press.truth] - other;
}

/// Whether a press has two labels to choose from.
bool has_choice(const ScoredPress& press) { return std::isfinite(margin_of(press)); }

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Logarithms of the labels' probabilities.
std::vector<double> log_probabilities(const ScoredPress& press, double temperature,
                                      double feature_weight) {
  std::vector<double> nats = scores(press, temperature, feature_weight);
  const double sum = log_sum_exp(nats);
  for (double& x : nats) {
    x -= sum;
  }
  return nats;
}

/// The place of the least value of a function with one minimum over [lower, upper], within a
/// thousandth of the interval.
template <typename Function>
double least_place(double lower, double upper, const Function& function) {
  return largest_at(lower, upper, 1e-3 * (upper - lower), [&](double x) { return -function(x); });
}

/// Every other press, from the first or the second on.
std::vector<ScoredPress> half_of(std::span<const ScoredPress> presses, std::size_t half) {
  std::vector<ScoredPress> some;
  for (std::size_t i = half; i < presses.size(); i += 2) {
    some.push_back(presses[i]);
  }
  return some;
}

double loss_of_groups(std::span<const ScoredPress> groups, TemperatureFit fit, double growth) {
  fit.growth = growth;
  double sum = 0.0;
  for (const ScoredPress& group : groups) {
    sum += loss_of(group, fit.temperature_after(group.touches), fit.feature_weight);
  }
  return sum;
}

/// The growth of the least loss, from 0, given the rest of the fit.
double least_growth(std::span<const ScoredPress> groups, const TemperatureFit& fit) {
  // Of groups of one size, the loss has one minimum along the growth's logarithm, as along the
  // temperature's.
  const double growth = std::exp(least_place(
      std::log(1e-3 * fit.temperature), std::log(most_temperature),
      [&](double log_growth) { return loss_of_groups(groups, fit, std::exp(log_growth)); }));
  return loss_of_groups(groups, fit, growth) < loss_of_groups(groups, fit, 0.0) ? growth : 0.0;
}

/// The growth that groups show, given the rest of the fit: 0 unless what each half of them shows
/// helps the other half, both taken together. A single group that is surely wrong, by a touch like
/// no other, is no growth.
double fit_growth(const GroupHalves& groups, const TemperatureFit& fit) {
  double gain = 0.0;
  for (std::size_t half = 0; half < 2; ++half) {
    const std::vector<ScoredPress>& other = groups[1 - half];
    gain += loss_of_groups(other, fit, 0.0) -
            loss_of_groups(other, fit, least_growth(groups[half], fit));
  }
  return gain > 0.0 ? least_growth(both(groups), fit) : 0.0;
}

}  // namespace

std::vector<ScoredPress> both(const GroupHalves& groups) {
  std::vector<ScoredPress> all = groups[0];
  all.insert(all.end(), groups[1].begin(), groups[1].end());
  return all;
}

std::vector<double> label_probabilities(const ScoredPress& press, double temperature,
                                        double feature_weight) {
  std::vector<double> p = log_probabilities(press, temperature, feature_weight);
  for (double& x : p) {
    x = std::exp(x);
  }
  return p;
}

Scores scores_of(std::span<const ScoredPress> presses, double temperature, double feature_weight) {
  require_sound(presses);
  std::vector<JudgedRecord> records;
  for (const ScoredPress& press : presses) {
    const std::vector<double> p = label_probabilities(press, temperature, feature_weight);
    JudgedRecord record{.truth = std::to_string(press.truth)};
    for (std::size_t label = 0; label < p.size(); ++label) {
      record.identity[std::to_string(label)] = p[label];
    }
    record.best = std::to_string(std::ranges::max_element(p) - p.begin());
    records.push_back(std::move(record));
  }
  return evaluate(records).all;
}

TemperatureFit fit_temperature(std::span<const ScoredPress> presses, const GroupHalves& groups) {
  require_sound(presses);
  for (const std::vector<ScoredPress>& half : groups) {
    if (!half.empty()) {
      require_sound(half);
    }
  }
  std::vector<double> margins;
  bool features = true;
  for (const ScoredPress& press : presses) {
    if (const double margin = std::abs(margin_of(press)); std::isfinite(margin)) {
      margins.push_back(margin);
    }
    features = features && !press.log_density.empty();
  }
  if (margins.empty()) {
    throw Error(Fault::input,
                "temperature: presses of one object say nothing about confidence; give presses of "
                "two objects or more");
  }
  const double margin = median(margins);
  // The loss is convex in the temperature's inverse and the weight, so that it has one minimum
  // along the logarithm of the temperature, and the least of these has one along the weight.
  const auto loss = [&](double log_temperature, double weight) {
    const double temperature = std::exp(log_temperature);
    const double apart = margin / temperature;
    double sum = apart / 2.0 + std::log1p(std::exp(-apart));
    for (const ScoredPress& press : presses) {
      sum += loss_of(press, temperature, weight);
    }
    return sum;
  };
  constexpr double least_temperature = 0.01;
  const auto best_temperature = [&](double weight) {
    return least_place(std::log(least_temperature), std::log(most_temperature),
                       [&](double log_temperature) { return loss(log_temperature, weight); });
  };
  constexpr double most_weight = 2.0;
  const double weight =
      features
          ? least_place(0.0, most_weight, [&](double w) { return loss(best_temperature(w), w); })
          : 0.0;
  TemperatureFit fit{.temperature = std::exp(best_temperature(weight)), .feature_weight = weight};
  fit.growth = fit_growth(groups, fit);
  return fit;
}

TemperedPresses tempered_by_halves(std::span<const ScoredPress> presses,
                                   const GroupHalves& groups) {
  TemperedPresses tempered{std::vector<ScoredPress>(presses.size()), {}};
  const auto with = [](const ScoredPress& press, const TemperatureFit& fit) {
    ScoredPress result{
        .truth = press.truth, .touches = press.touches, .log_evidence = {}, .log_density = {}};
    result.log_evidence =
        log_probabilities(press, fit.temperature_after(press.touches), fit.feature_weight);
    return result;
  };
  for (std::size_t half = 0; half < 2; ++half) {
    const std::vector<ScoredPress> others = half_of(presses, 1 - half);
    TemperatureFit fit = fit_temperature(
        std::ranges::any_of(others, has_choice) ? std::span<const ScoredPress>(others) : presses);
    for (std::size_t i = half; i < presses.size(); i += 2) {
      tempered.presses[i] = with(presses[i], fit);
    }
    fit.growth = least_growth(groups[1 - half], fit);
    for (const ScoredPress& group : groups[half]) {
      tempered.groups.push_back(with(group, fit));
    }
  }
  return tempered;
}

}  // namespace palpate
