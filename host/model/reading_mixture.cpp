// Highway compiles this file once for every set of vector instructions. Products and sums are never
// fused and lanes never mixed, so that every set gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/reading_mixture.cpp"
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/reading_mixture.hpp"
#include "model/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

// A vector of at most `mixture_lanes` numbers: lists are padded to no more.
using Numbers = hn::CappedTag<double, mixture_lanes>;

/// sums[h] = rows[0][h] + rows[1][h] + ..., in this order.
void SumRows(const double* const* rows, std::size_t count, double* sums, std::size_t hypotheses) {
  const Numbers d;
  for (std::size_t h = 0; h < hypotheses; h += mixture_lanes) {
    // So many sums at once that an addition need not wait for the one before it.
    constexpr std::size_t parts = mixture_lanes / hn::MaxLanes(Numbers());
    hn::Vec<Numbers> sum[parts];
    for (std::size_t part = 0; part < parts; ++part) {
      sum[part] = hn::Zero(d);
    }
    for (std::size_t row = 0; row < count; ++row) {
      for (std::size_t part = 0; part < parts; ++part) {
        sum[part] = hn::Add(sum[part], hn::LoadU(d, rows[row] + h + part * hn::MaxLanes(d)));
      }
    }
    for (std::size_t part = 0; part < parts; ++part) {
      hn::StoreU(sum[part], d, sums + h + part * hn::MaxLanes(d));
    }
  }
}

/// @returns the largest value, and in `sums` those of exp(v - largest) over every 8th value
double SumExps(const double* values, std::size_t count, double* sums) {
  const Numbers d;
  auto largest = hn::LoadU(d, values);
  for (std::size_t i = hn::MaxLanes(d); i < count; i += hn::MaxLanes(d)) {
    largest = hn::Max(largest, hn::LoadU(d, values + i));
  }
  largest = hn::MaxOfLanes(d, largest);
  constexpr std::size_t parts = mixture_lanes / hn::MaxLanes(Numbers());
  for (std::size_t part = 0; part < parts; ++part) {
    auto sum = hn::Zero(d);
    for (std::size_t i = part * hn::MaxLanes(d); i < count; i += mixture_lanes) {
      sum = hn::Add(sum, exp_of_minus(d, hn::Sub(largest, hn::LoadU(d, values + i))));
    }
    hn::StoreU(sum, d, sums + part * hn::MaxLanes(d));
  }
  return hn::GetLane(largest);
}

/// Finds the probability of every reading of an element, and adds the mean and the variance of its
/// log-likelihood under these probabilities to those of the touch.
/// @param log_likelihood,probability [level, hypothesis]
void PredictElement(const double* log_likelihood, double* probability, std::size_t levels,
                    double* mean, double* variance, std::size_t hypotheses) {
  const Numbers d;
  for (std::size_t h = 0; h < hypotheses; h += hn::MaxLanes(d)) {
    const auto nats = [&](std::size_t level) HWY_ATTR {
      return hn::LoadU(d, log_likelihood + level * hypotheses + h);
    };
    auto largest = nats(0);
    for (std::size_t level = 1; level < levels; ++level) {
      largest = hn::Max(largest, nats(level));
    }
    auto total = hn::Zero(d);
    for (std::size_t level = 0; level < levels; ++level) {
      const auto share = exp_of_minus(d, hn::Sub(largest, nats(level)));
      hn::StoreU(share, d, probability + level * hypotheses + h);
      total = hn::Add(total, share);
    }
    // The moments relative to the largest: no cancellation.
    auto below_largest = hn::Zero(d);
    for (std::size_t level = 0; level < levels; ++level) {
      double* const at = probability + level * hypotheses + h;
      const auto share = hn::Div(hn::LoadU(d, at), total);
      hn::StoreU(share, d, at);
      below_largest = hn::Add(below_largest, hn::Mul(share, hn::Sub(nats(level), largest)));
    }
    auto squares = hn::Zero(d);
    for (std::size_t level = 0; level < levels; ++level) {
      const auto from_mean = hn::Sub(hn::Sub(nats(level), largest), below_largest);
      squares = hn::Add(squares, hn::Mul(hn::LoadU(d, probability + level * hypotheses + h),
                                         hn::Mul(from_mean, from_mean)));
    }
    hn::StoreU(hn::Add(hn::LoadU(d, mean + h), hn::Add(largest, below_largest)), d, mean + h);
    hn::StoreU(hn::Add(hn::LoadU(d, variance + h), squares), d, variance + h);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

namespace palpate {

HWY_EXPORT(SumRows);
HWY_EXPORT(SumExps);
HWY_EXPORT(PredictElement);

namespace {

/// Rows a power of two apart would share the few lines of a cache that have such addresses: what is
/// written and read column by column would not stay in it.
std::size_t padded(std::size_t hypotheses) {
  constexpr std::size_t few_lines = 64;
  const std::size_t lanes = (hypotheses + mixture_lanes - 1) / mixture_lanes * mixture_lanes;
  return lanes % few_lines == 0 ? lanes + mixture_lanes : lanes;
}

/// log of the sum of exp(v). Within 1e-13 of itself, plus 2^-1021 of it for every v.
/// @param values padded with -infinity
double log_sum_exp(std::span<const double> values) {
  double sums[mixture_lanes];
  const double largest = HWY_DYNAMIC_DISPATCH(SumExps)(values.data(), values.size(), sums);
  return largest + std::log(std::accumulate(std::begin(sums), std::end(sums), 0.0));
}

}  // namespace

ReadingMixture::ReadingMixture(std::size_t hypotheses, std::size_t elements, std::size_t levels)
    : hypotheses_(hypotheses),
      stride_(padded(hypotheses)),
      elements_(elements),
      levels_(levels),
      log_likelihood_(stride_ * elements * levels) {}

double ReadingMixture::log_mean(std::span<const Reading> readings) const {
  thread_local std::vector<const double*> rows;
  thread_local std::vector<double> logs;
  rows.clear();
  for (std::size_t e = 0; e < elements_; ++e) {
    rows.push_back(row(e, static_cast<std::size_t>(readings[e])));
  }
  logs.resize(stride_);
  HWY_DYNAMIC_DISPATCH(SumRows)(rows.data(), rows.size(), logs.data(), logs.size());
  std::fill(logs.begin() + static_cast<std::ptrdiff_t>(hypotheses_), logs.end(),
            -std::numeric_limits<double>::infinity());
  return log_sum_exp(logs) - std::log(static_cast<double>(hypotheses_));
}

PredictedTouches::PredictedTouches(const ReadingMixture& mixture)
    : mixture_(mixture),
      probability_(mixture.log_likelihood_.size()),
      mean_(mixture.stride_),
      variance_(mixture.stride_) {
  for (std::size_t e = 0; e < mixture.elements(); ++e) {
    const std::size_t first = e * mixture.levels() * mixture.stride_;
    HWY_DYNAMIC_DISPATCH(PredictElement)
    (mixture.row(e, 0), probability_.data() + first, mixture.levels(), mean_.data(),
     variance_.data(), mean_.size());
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
    log_mean.push_back(judge.log_mean(touches[i].readings));
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
#endif  // HWY_ONCE
