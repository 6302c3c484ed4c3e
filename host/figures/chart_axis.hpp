#pragma once

#include <span>
#include <vector>

#include "figures/axes.hpp"
#include "figures/chart.hpp"

namespace palpate {

/// Extent and ticks of an axis.
struct AxisSpan {
  double lower = 0.0;
  double upper = 1.0;
  std::vector<Tick> ticks = {};
};

/// Fits an axis to the data.
/// @param values values to show, of which those that are not finite are ignored; may be empty
AxisSpan span_of(const ChartAxis& axis, std::span<const double> values);

}  // namespace palpate
