#include "reading_mixture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "palpate/fit.hpp"
#include "predicted_readings.hpp"

namespace palpate {

ReadingMixture::ReadingMixture(std::size_t hypotheses, std::size_t elements, std::size_t levels)
    : hypotheses_(hypotheses),
      elements_(elements),
      levels_(levels),
      log_likelihood_(hypotheses * elements * levels) {}

void ReadingMixture::set(std::size_t hypothesis, std::span<const double> log_likelihoods) {
  for (std::size_t i = 0; i < log_likelihoods.size(); ++i) {
    log_likelihood_[i * hypotheses_ + hypothesis] = log_likelihoods[i];
  }
}

double ReadingMixture::log_mean(std::span<const Reading> readings, std::size_t left_out) const {
  std::vector<double> logs(hypotheses_);
  for (std::size_t e = 0; e < elements_; ++e) {
    const double* row =
        &log_likelihood_[(e * levels_ + static_cast<std::size_t>(readings[e])) * hypotheses_];
    for (std::size_t h = 0; h < hypotheses_; ++h) {
      logs[h] += row[h];
    }
  }
  if (left_out < hypotheses_) {
    logs.erase(logs.begin() + static_cast<std::ptrdiff_t>(left_out));
  }
  const double most = *std::max_element(logs.begin(), logs.end());
  double sum = 0.0;
  for (const double l : logs) {
    sum += std::exp(l - most);
  }
  return most + std::log(sum / static_cast<double>(logs.size()));
}

ReadingMixture::DrawnTouch ReadingMixture::draw(std::size_t hypothesis, Random& random) const {
  DrawnTouch touch;
  touch.readings.reserve(elements_);
  for (std::size_t e = 0; e < elements_; ++e) {
    std::array<double, most_reading_levels> log_p{};
    for (std::size_t level = 0; level < levels_; ++level) {
      log_p[level] = log_likelihood_[(e * levels_ + level) * hypotheses_ + hypothesis];
    }
    const PredictedReading predicted = predicted_reading(std::span(log_p).first(levels_));
    double at = random.uniform();
    std::size_t drawn = levels_ - 1;  // also where rounding leads past the last
    for (std::size_t level = 0; level < levels_; ++level) {
      const double q = predicted.probability[level];
      if (at >= 0.0 && at < q) {
        drawn = level;
      }
      at -= q;
      const double from_mean = log_p[level] - predicted.most - predicted.below_most;
      touch.variance += q * from_mean * from_mean;
    }
    touch.mean += predicted.most + predicted.below_most;
    touch.log_likelihood += log_p[drawn];
    touch.readings.push_back(static_cast<Reading>(drawn));
  }
  return touch;
}

double Moments::deviations(double value) const {
  return value == mean
             ? 0.0
             : std::clamp((value - mean) / std::sqrt(variance), -largest_fit_z, largest_fit_z);
}

Moments predicted_log_mean(const ReadingMixture& judge, const ReadingMixture& source,
                           Random& random) {
  const std::size_t n = source.hypotheses();
  const auto mean_of = [n](const auto& value) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += value(i);
    }
    return sum / static_cast<double>(n);
  };
  std::vector<ReadingMixture::DrawnTouch> touches;
  std::vector<double> log_mean;
  for (std::size_t i = 0; i < n; ++i) {
    touches.push_back(source.draw(i, random));
    log_mean.push_back(
        judge.log_mean(touches[i].readings, &judge == &source ? i : ReadingMixture::all));
  }
  // What the control variate is among the touches drawn, and what it is among all.
  const double drawn_mean = mean_of([&](std::size_t i) { return touches[i].log_likelihood; });
  const double judged_mean = mean_of([&](std::size_t i) { return log_mean[i]; });
  const double control_mean = mean_of([&](std::size_t i) { return touches[i].mean; });
  const double control_variance =
      mean_of([&](std::size_t i) { return touches[i].variance; }) +
      mean_of([&](std::size_t i) { return std::pow(touches[i].mean - control_mean, 2.0); });
  const double drawn_variance =
      mean_of([&](std::size_t i) { return std::pow(touches[i].log_likelihood - drawn_mean, 2.0); });
  const double covariance = mean_of([&](std::size_t i) {
    return (touches[i].log_likelihood - drawn_mean) * (log_mean[i] - judged_mean);
  });
  const double slope = drawn_variance > 0.0 ? covariance / drawn_variance : 1.0;
  const double rest = mean_of([&](std::size_t i) {
    return std::pow(log_mean[i] - judged_mean - slope * (touches[i].log_likelihood - drawn_mean),
                    2.0);
  });
  return {.mean = judged_mean + slope * (control_mean - drawn_mean),
          .variance = slope * slope * control_variance + rest};
}

}  // namespace palpate
