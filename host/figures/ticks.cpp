#include "figures/ticks.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace palpate {

std::string number(double value) {
  std::string text = fmt::format("{:g}", value);
  if (text.front() == '-') {
    text.replace(0, 1, "−");
  }
  return text;
}

std::vector<Tick> even_ticks(double lower, double upper, int count, double smallest_step) {
  const double width = (upper - lower) / count;
  const double decade = std::pow(10.0, std::floor(std::log10(width)));
  double step = 10.0 * decade;
  for (const double factor : {5.0, 2.0, 1.0}) {
    // The margin keeps a width that is itself a step from being rounded up to the next one.
    if (factor * decade >= width * (1.0 - 1e-9)) {
      step = factor * decade;
    }
  }
  step = std::max(step, smallest_step);

  const double margin = 1e-9 * (upper - lower);
  std::vector<Tick> ticks;
  const double first = std::ceil((lower - margin) / step);
  for (int k = 0; k <= count && (first + k) * step <= upper + margin; ++k) {
    const double value = (first + k) * step + 0.0;  // adding zero turns -0 into 0
    ticks.push_back({value, number(value)});
  }
  return ticks;
}

}  // namespace palpate
