#include "model/reading_mixture.hpp"

#include <algorithm>
#include <cmath>

#include "model/mixture_kernel.hpp"
#include "palpate/fit.hpp"

namespace palpate {

namespace {

/// Rows a power of two apart would share the few lines of a cache that have such addresses: what is
/// written and read column by column would not stay in it.
std::size_t padded(std::size_t hypotheses) {
  constexpr std::size_t few_lines = 64;
  const std::size_t lanes = (hypotheses + mixture_lanes - 1) / mixture_lanes * mixture_lanes;
  return lanes % few_lines == 0 ? lanes + mixture_lanes : lanes;
}

}  // namespace

ReadingMixture::ReadingMixture(std::size_t hypotheses, std::size_t elements, std::size_t levels)
    : hypotheses_(hypotheses),
      stride_(padded(hypotheses)),
      elements_(elements),
      levels_(levels),
      log_likelihood_(stride_ * elements * levels) {}

double ReadingMixture::log_mean(std::span<const Reading> readings, std::size_t left_out) const {
  thread_local std::vector<const double*> rows;
  thread_local std::vector<double> logs;
  rows.clear();
  for (std::size_t e = 0; e < elements_; ++e) {
    rows.push_back(row(e, static_cast<std::size_t>(readings[e])));
  }
  logs.resize(stride_);
  sum_rows(rows, logs);
  constexpr double none = -std::numeric_limits<double>::infinity();
  std::fill(logs.begin() + static_cast<std::ptrdiff_t>(hypotheses_), logs.end(), none);
  std::size_t count = hypotheses_;
  if (left_out < hypotheses_) {
    logs[left_out] = none;
    --count;
  }
  return log_sum_exp(logs) - std::log(static_cast<double>(count));
}

PredictedTouches::PredictedTouches(const ReadingMixture& mixture)
    : mixture_(mixture),
      probability_(mixture.log_likelihood_.size()),
      mean_(mixture.stride_),
      variance_(mixture.stride_) {
  for (std::size_t e = 0; e < mixture.elements(); ++e) {
    const std::size_t first = e * mixture.levels() * mixture.stride_;
    predict_element({.log_likelihood = mixture.row(e, 0),
                     .probability = probability_.data() + first,
                     .levels = mixture.levels()},
                    mean_, variance_);
  }
}

PredictedTouches::DrawnTouch PredictedTouches::draw(std::size_t hypothesis, Random& random) const {
  DrawnTouch touch{.readings = {}, .mean = mean_[hypothesis], .variance = variance_[hypothesis]};
  touch.readings.reserve(mixture_.elements());
  const std::size_t levels = mixture_.levels();
  for (std::size_t e = 0; e < mixture_.elements(); ++e) {
    const double* const q = probability_.data() + e * levels * mixture_.stride_ + hypothesis;
    double at = random.uniform();
    std::size_t drawn = 0;
    while (drawn + 1 < levels && at >= q[drawn * mixture_.stride_]) {
      at -= q[drawn * mixture_.stride_];
      ++drawn;  // to the last, also where rounding leads past it
    }
    touch.log_likelihood += mixture_.row(e, drawn)[hypothesis];
    touch.readings.push_back(static_cast<Reading>(drawn));
  }
  return touch;
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
  const PredictedTouches predicted(source);
  std::vector<PredictedTouches::DrawnTouch> touches;
  std::vector<double> log_mean;
  for (std::size_t i = 0; i < n; ++i) {
    touches.push_back(predicted.draw(i, random));
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
