#pragma once

#include <cmath>
#include <limits>

namespace palpate {

/// The log of a sum of numbers that are given by their logs, in float64. Infinity and NaN stay.
class LogSum {
 public:
  void add(double log_value) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!(largest_ < infinity)) {
      largest_ = std::isnan(log_value) ? log_value : largest_;
    } else if (!(log_value < infinity)) {
      largest_ = log_value;
      sum_ = 1.0;
    } else if (log_value > largest_) {
      sum_ = sum_ * std::exp(largest_ - log_value) + 1.0;
      largest_ = log_value;
    } else if (log_value > -infinity) {
      sum_ += std::exp(log_value - largest_);
    }
  }
  double log() const { return largest_ + std::log(sum_); }

 private:
  double largest_ = -std::numeric_limits<double>::infinity();
  double sum_ = 0.0;
};

/// log(exp(a) + exp(b)); either may be -infinity.
inline double log_add(double a, double b) {
  LogSum sum;
  sum.add(a);
  sum.add(b);
  return sum.log();
}

/// log(exp(a) - exp(b)); -infinity where b is not the smaller one.
inline double log_subtract(double a, double b) {
  return b < a ? a + std::log1p(-std::exp(b - a)) : -std::numeric_limits<double>::infinity();
}

}  // namespace palpate
