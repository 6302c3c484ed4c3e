#pragma once

#include <span>
#include <vector>

#include "figures/axes.hpp"
#include "figures/chart.hpp"

namespace palpate {

/// Extent and ticks of an axis. A place is the coordinate in which the axis is linear: the value
/// itself, or its decadic logarithm.
struct AxisSpan {
  Scale scale = Scale::linear;
  double lower = 0.0;  ///< place of the axis' lower end
  double upper = 1.0;
  std::vector<Tick> ticks = {};   ///< labelled; `value` is a place
  std::vector<double> fine = {};  ///< places of grid lines without a label

  /// True where the scale has a place for the value.
  bool has(double value) const;
  double place(double value) const;
};

/// Fits an axis to the data.
/// @param values values to show, of which those without a place are ignored; may be empty
AxisSpan span_of(const ChartAxis& axis, std::span<const double> values);

}  // namespace palpate
