#pragma once

#include <string>
#include <vector>

namespace palpate {

/// A labelled value on an axis.
struct Tick {
  double value = 0.0;
  std::string label;
};

/// Returns the number in its shortest form, to six digits, with a true minus sign.
std::string number(double value);

/// Returns at most `count` + 1 ticks within [lower, upper]. Their step is 1, 2 or 5 times a power
/// of ten and at least `smallest_step`.
std::vector<Tick> even_ticks(double lower, double upper, int count, double smallest_step = 0.0);

}  // namespace palpate
