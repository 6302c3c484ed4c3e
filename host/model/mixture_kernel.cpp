// Highway compiles this file once for every set of vector instructions. Products and sums are never
// fused and lanes never mixed, so that every set gives the same bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "model/mixture_kernel.cpp"
#define HWY_COMPILE_ALL_ATTAINABLE
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "model/mixture_kernel.hpp"
#include "model/vector_math-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace palpate {
namespace HWY_NAMESPACE {

// A vector of at most `mixture_lanes` numbers: lists are padded to no more.
using Numbers = hn::CappedTag<double, mixture_lanes>;

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
  auto most = hn::LoadU(d, values);
  for (std::size_t i = hn::MaxLanes(d); i < count; i += hn::MaxLanes(d)) {
    most = hn::Max(most, hn::LoadU(d, values + i));
  }
  most = hn::MaxOfLanes(d, most);
  constexpr std::size_t parts = mixture_lanes / hn::MaxLanes(Numbers());
  for (std::size_t part = 0; part < parts; ++part) {
    auto sum = hn::Zero(d);
    for (std::size_t i = part * hn::MaxLanes(d); i < count; i += mixture_lanes) {
      sum = hn::Add(sum, exp_of_minus(d, hn::Sub(most, hn::LoadU(d, values + i))));
    }
    hn::StoreU(sum, d, sums + part * hn::MaxLanes(d));
  }
  return hn::GetLane(most);
}

void PredictElement(const ElementPrediction& element, double* mean, double* variance,
                    std::size_t hypotheses) {
  const Numbers d;
  for (std::size_t h = 0; h < hypotheses; h += hn::MaxLanes(d)) {
    const auto log_likelihood = [&](std::size_t level) HWY_ATTR {
      return hn::LoadU(d, element.log_likelihood + level * hypotheses + h);
    };
    auto most = log_likelihood(0);
    for (std::size_t level = 1; level < element.levels; ++level) {
      most = hn::Max(most, log_likelihood(level));
    }
    auto total = hn::Zero(d);
    for (std::size_t level = 0; level < element.levels; ++level) {
      const auto share = exp_of_minus(d, hn::Sub(most, log_likelihood(level)));
      hn::StoreU(share, d, element.probability + level * hypotheses + h);
      total = hn::Add(total, share);
    }
    // The moments relative to the largest: no cancellation.
    auto below_most = hn::Zero(d);
    for (std::size_t level = 0; level < element.levels; ++level) {
      double* const at = element.probability + level * hypotheses + h;
      const auto probability = hn::Div(hn::LoadU(d, at), total);
      hn::StoreU(probability, d, at);
      below_most = hn::Add(below_most, hn::Mul(probability, hn::Sub(log_likelihood(level), most)));
    }
    auto squares = hn::Zero(d);
    for (std::size_t level = 0; level < element.levels; ++level) {
      const auto from_mean = hn::Sub(hn::Sub(log_likelihood(level), most), below_most);
      squares = hn::Add(squares, hn::Mul(hn::LoadU(d, element.probability + level * hypotheses + h),
                                         hn::Mul(from_mean, from_mean)));
    }
    hn::StoreU(hn::Add(hn::LoadU(d, mean + h), hn::Add(most, below_most)), d, mean + h);
    hn::StoreU(hn::Add(hn::LoadU(d, variance + h), squares), d, variance + h);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace palpate
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <cmath>
#include <iterator>
#include <numeric>

namespace palpate {

HWY_EXPORT(SumRows);
HWY_EXPORT(SumExps);
HWY_EXPORT(PredictElement);

void sum_rows(std::span<const double* const> rows, std::span<double> sums) {
  HWY_DYNAMIC_DISPATCH(SumRows)(rows.data(), rows.size(), sums.data(), sums.size());
}

double log_sum_exp(std::span<const double> values) {
  double sums[mixture_lanes];
  const double most = HWY_DYNAMIC_DISPATCH(SumExps)(values.data(), values.size(), sums);
  return most + std::log(std::accumulate(std::begin(sums), std::end(sums), 0.0));
}

void predict_element(const ElementPrediction& element, std::span<double> mean,
                     std::span<double> variance) {
  HWY_DYNAMIC_DISPATCH(PredictElement)(element, mean.data(), variance.data(), mean.size());
}

}  // namespace palpate
#endif  // HWY_ONCE
