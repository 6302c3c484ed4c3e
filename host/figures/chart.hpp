#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "figures/palette.hpp"
#include "figures/ticks.hpp"

namespace palpate {

struct ChartAxis {
  std::string label;
  double lower = 0.0;
  double upper = 1.0;
  std::vector<Tick> ticks = {};  ///< empty: round numbers
};

enum class Mark { none, circle, square };
enum class Line { none, solid, dotted };

/// A point within the axes.
struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  double low = std::numeric_limits<double>::quiet_NaN();  ///< of y; NaN: no interval
  double high = std::numeric_limits<double>::quiet_NaN();
  std::string label = {};  ///< text beside the point, where there is room
  double size = 1.0;       ///< of its mark, above 0; the interval is as faint as the mark is small
};

struct ChartSeries {
  std::string name;  ///< in the legend; a series without a name stays out of it
  Colour colour = ink;
  Mark mark = Mark::circle;
  Line line = Line::none;
  std::vector<ChartPoint> points = {};
};

/// Grey for a series that others are compared with.
inline constexpr Colour comparison_grey{0.38, 0.38, 0.38};

/// Series of points in one pair of axes, with a legend above.
struct Chart {
  std::string title = {};  ///< above the legend; none where empty
  ChartAxis x;
  ChartAxis y;
  std::vector<ChartSeries> series = {};
  std::optional<double> rule = {};  ///< x of a dotted vertical line, in comparison_grey
  std::string left_of_rule = {};    ///< label of the x axis on that side, where it has another
};

/// Draws the chart. Returns the bytes of a PNG file.
/// @throws Error (Fault::system) where Cairo fails
std::string draw_chart(const Chart& chart);

}  // namespace palpate
