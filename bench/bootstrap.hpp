#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "measurement.hpp"

namespace palpate::bench {

/// A statistic of some trials, given by their indices; an index may come more than once.
using Statistic = std::function<double(std::span<const std::size_t> trials)>;

/// The 95 % interval of a statistic: the 2.5th and the 97.5th percentile of its values over 2,000
/// samples of as many trials, drawn with replacement (Efron 1979). The same input gives the same
/// interval. trials > 0.
Interval bootstrap_interval(std::size_t trials, const Statistic& statistic);

/// That of the values' mean. At least one value.
Interval bootstrap_mean_interval(std::span<const double> values);

/// That of mean(numerators) / mean(denominators), paired by index. At least one pair.
Interval bootstrap_ratio_interval(std::span<const double> numerators,
                                  std::span<const double> denominators);

}  // namespace palpate::bench
