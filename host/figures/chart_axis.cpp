#include "figures/chart_axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

namespace {

constexpr int most_ticks = 7;

std::string text_of(const ChartAxis& axis, double value) {
  return axis.text ? axis.text(value) : number(value);
}

/// Ends the axis at whole ticks, so that no curve meets the frame between two ticks.
void set_ticks(const ChartAxis& axis, AxisSpan& span) {
  const std::vector<Tick> within = even_ticks(span.lower, span.upper, most_ticks);
  const double step = within.size() > 1 ? within[1].value - within[0].value : 0.0;
  if (step > 0.0) {
    span.lower = axis.lower.value_or(step * std::floor(span.lower / step + 1e-9));
    span.upper = axis.upper.value_or(step * std::ceil(span.upper / step - 1e-9));
  }
  for (const Tick& tick : even_ticks(span.lower, span.upper, most_ticks + 2, step)) {
    span.ticks.push_back({tick.value, text_of(axis, tick.value)});
  }
}

}  // namespace

AxisSpan span_of(const ChartAxis& axis, std::span<const double> values) {
  AxisSpan span{.lower = std::numeric_limits<double>::infinity(),
                .upper = -std::numeric_limits<double>::infinity()};
  for (const double value : values) {
    if (std::isfinite(value)) {
      span.lower = std::min(span.lower, value);
      span.upper = std::max(span.upper, value);
    }
  }
  if (span.lower > span.upper) {
    span.lower = span.upper = 0.0;
  }
  span.lower = axis.lower.value_or(span.lower);
  span.upper = axis.upper.value_or(span.upper);
  if (!(span.lower < span.upper)) {
    span.upper = span.lower + 1.0;
  }
  set_ticks(axis, span);
  return span;
}

}  // namespace palpate
