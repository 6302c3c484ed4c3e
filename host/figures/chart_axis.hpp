#pragma once

#include <span>
#include <vector>

#include "axes.hpp"
#include "chart.hpp"

namespace palpate {

/// The extent and the ticks of an axis that shows given values. Places are what the axis is linear
/// in: the values themselves, or their decadic logarithms.
struct AxisSpan {
  Scale scale = Scale::linear;
  double lower = 0.0;  ///< place of the axis' lower end
  double upper = 1.0;
  std::vector<Tick> ticks = {};   ///< labelled; `value` is a place
  std::vector<double> fine = {};  ///< places of grid lines without a label

  /// Whether the scale has a place for the value.
  bool has(double value) const;
  double place(double value) const;
};

/// @param values those of them that the scale has count; none is required
AxisSpan span_of(const ChartAxis& axis, std::span<const double> values);

}  // namespace palpate
