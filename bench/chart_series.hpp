#pragma once

#include <string>
#include <vector>

#include "figures/chart.hpp"
#include "table.hpp"

namespace palpate::bench {

/// The look of the i-th series: told apart by mark and dashes as well as by colour.
ChartSeries series_like(std::size_t i, std::string name);

/// A field of records over another, a gap where a record has none. Fields are JSON pointers.
std::vector<ChartPoint> points_of(const Json& records, const char* x, const char* y);

/// An axis of fractions, in percent.
ChartAxis percent_axis(std::string label, double upper = 1.05);

}  // namespace palpate::bench
