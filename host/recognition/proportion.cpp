#include "recognition/proportion.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace palpate {

Interval wilson_interval(double successes, std::size_t trials) {
  constexpr double z = 1.959964;  // the standard normal's 97.5th percentile
  const auto n = static_cast<double>(trials);
  const double p = successes / n;
  const double centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half_width =
      z / (1.0 + z * z / n) * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  // Rounding must not leave the ends at 0 and 1 outside.
  return {successes == 0.0 ? 0.0 : centre - half_width, successes == n ? 1.0 : centre + half_width};
}

double told_apart(std::span<const double> lower, std::span<const double> higher) {
  std::vector<double> sorted(higher.begin(), higher.end());
  std::sort(sorted.begin(), sorted.end());
  double apart = 0.0;
  for (const double low : lower) {
    const auto [first, last] = std::equal_range(sorted.begin(), sorted.end(), low);
    apart += static_cast<double>(sorted.end() - last) + 0.5 * static_cast<double>(last - first);
  }
  return apart / (static_cast<double>(lower.size()) * static_cast<double>(higher.size()));
}

double told_apart_error(double area, std::size_t lower, std::size_t higher) {
  const auto n_lower = static_cast<double>(lower);
  const auto n_higher = static_cast<double>(higher);
  // The probability that two values of one kind are both on the right side of one of the other.
  const double two_higher = area / (2.0 - area);
  const double two_lower = 2.0 * area * area / (1.0 + area);
  const double square = area * area;
  const double variance = area * (1.0 - area) + (n_higher - 1.0) * (two_higher - square) +
                          (n_lower - 1.0) * (two_lower - square);
  return std::sqrt(std::max(variance, 0.0) / (n_lower * n_higher));
}

}  // namespace palpate
