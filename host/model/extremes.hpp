#pragma once

#include <algorithm>
#include <optional>

namespace palpate {

/// The smallest and the largest of some numbers.
struct Extremes {
  double least;
  double most;

  void include(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
  double span() const { return most - least; }
  double largest_magnitude() const { return std::max(-least, most); }
};

inline void include(std::optional<Extremes>& extremes, double value) {
  if (!extremes) {
    extremes = {value, value};
  }
  extremes->include(value);
}

}  // namespace palpate
