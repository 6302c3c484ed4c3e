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
void set_linear_ticks(const ChartAxis& axis, AxisSpan& span) {
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

/// Labels 1, 2 and 5 of every decade, all digits on short axes, whole decades on long ones.
void set_logarithmic_ticks(const ChartAxis& axis, AxisSpan& span) {
  const double decades = span.upper - span.lower;
  const int stride = std::max(1, static_cast<int>(std::ceil(decades / (most_ticks + 3))));
  constexpr double rounding = 1e-9;
  for (int decade = static_cast<int>(std::floor(span.lower)); decade <= span.upper + rounding;
       ++decade) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double place = decade + std::log10(digit);
      if (place < span.lower - rounding || place > span.upper + rounding) {
        continue;
      }
      const bool labelled = digit == 1 ? decade % stride == 0
                                       : (decades < 3.2 && (digit == 2 || digit == 5)) ||
                                             (decades < 0.8 && digit < 9);
      if (labelled) {
        span.ticks.push_back({place, text_of(axis, std::pow(10.0, decade) * digit)});
      } else if (digit == 1 || decades < 8.0) {
        span.fine.push_back(place);
      }
    }
  }
  if (span.ticks.size() < 2 && decades < 0.8) {
    // An axis this short may hold no whole digit; it gets evenly spaced ticks.
    span.ticks.clear();
    for (const Tick& tick :
         even_ticks(std::pow(10.0, span.lower), std::pow(10.0, span.upper), most_ticks)) {
      span.ticks.push_back({std::log10(tick.value), text_of(axis, tick.value)});
    }
  }
}

}  // namespace

bool AxisSpan::has(double value) const {
  return std::isfinite(value) && (scale == Scale::linear || value > 0.0);
}

double AxisSpan::place(double value) const {
  return scale == Scale::linear ? value : std::log10(value);
}

AxisSpan span_of(const ChartAxis& axis, std::span<const double> values) {
  AxisSpan span{.scale = axis.scale,
                .lower = std::numeric_limits<double>::infinity(),
                .upper = -std::numeric_limits<double>::infinity()};
  for (const double value : values) {
    if (span.has(value)) {
      span.lower = std::min(span.lower, span.place(value));
      span.upper = std::max(span.upper, span.place(value));
    }
  }
  if (span.lower > span.upper) {
    span.lower = span.upper = 0.0;
  }
  const bool logarithmic = axis.scale == Scale::logarithmic;
  if (logarithmic) {
    // Room for the marks at the ends.
    const double room = std::max(0.05 * (span.upper - span.lower), 0.06);
    span.lower -= room;
    span.upper += room;
  }
  span.lower = axis.lower ? span.place(*axis.lower) : span.lower;
  span.upper = axis.upper ? span.place(*axis.upper) : span.upper;
  if (!(span.lower < span.upper)) {
    span.upper = span.lower + 1.0;
  }
  logarithmic ? set_logarithmic_ticks(axis, span) : set_linear_ticks(axis, span);
  return span;
}

}  // namespace palpate
