#pragma once

namespace palpate {

/// Where a function with one minimum in [low, high] is least, by golden sections (Kiefer 1953),
/// within half of `tolerance`; the lowest of several such places.
template <typename Function>
double least_at(double low, double high, double tolerance, const Function& function) {
  constexpr double golden = 0.6180339887498949;
  double left = high - golden * (high - low);
  double right = low + golden * (high - low);
  double at_left = function(left);
  double at_right = function(right);
  while (high - low > tolerance) {
    if (at_left <= at_right) {
      high = right;
      right = left;
      at_right = at_left;
      left = high - golden * (high - low);
      at_left = function(left);
    } else {
      low = left;
      left = right;
      at_left = at_right;
      right = low + golden * (high - low);
      at_right = function(right);
    }
  }
  return (low + high) / 2.0;
}

}  // namespace palpate
