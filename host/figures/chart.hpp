#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "figures/palette.hpp"
#include "figures/picture_format.hpp"

namespace palpate {

enum class Scale { linear, logarithmic };

struct ChartAxis {
  std::string label;
  Scale scale = Scale::linear;
  /// Ends of the axis. An end that is not given follows the data, with room for the marks.
  std::optional<double> lower = {};
  std::optional<double> upper = {};
  /// Writes the label of a tick; empty: the number in its shortest form.
  std::function<std::string(double)> text = {};
};

enum class Mark { none, circle, square, triangle, diamond, cross };
enum class MarkFill { solid, pale, hollow };
enum class Line { none, solid, dashed, dotted };
/// Shape of the points' intervals: error bars, or a band along the series.
enum class IntervalShape { bars, band };

/// A point, drawn where both coordinates are finite and, on a logarithmic axis, positive. A point
/// that is not drawn leaves a gap in its line; a point beyond the ends of an axis has no mark.
struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  double low = std::numeric_limits<double>::quiet_NaN();  ///< of y; NaN: no interval
  double high = std::numeric_limits<double>::quiet_NaN();
  std::string label = {};  ///< text beside the point, where there is room
  std::string title = {};  ///< text under the pointer, on a page
};

struct ChartSeries {
  std::string name;  ///< in the legend; a series without a name stays out of it
  Colour colour = ink;
  Mark mark = Mark::circle;
  MarkFill fill = MarkFill::solid;
  Line line = Line::none;
  IntervalShape interval = IntervalShape::bars;
  std::size_t mark_every = 1;  ///< points from one mark to the next
  std::vector<ChartPoint> points = {};
};

/// A dotted line across the chart at one value of x (`vertical`) or of y.
struct ChartRule {
  bool vertical = false;
  double at = 0.0;
  Colour colour = ink;
  std::string label;
};

/// Series of points in one pair of axes, with a legend above.
struct Chart {
  std::string title = {};  ///< above the legend; none where empty
  ChartAxis x;
  ChartAxis y;
  std::vector<ChartSeries> series = {};
  std::vector<ChartRule> rules = {};
};

/// The middle of a mark in pixels of the picture, and its point's title.
struct ChartSpot {
  glm::dvec2 at_px;
  std::string title;
};

/// A chart as the bytes of a file.
struct ChartPicture {
  std::string bytes;
  int width_px = 0;
  int height_px = 0;
  std::vector<ChartSpot> spots;  ///< of the points with a title
};

/// Draws the chart as a PNG or SVG file.
/// @throws Error (Fault::system) where Cairo fails
ChartPicture draw_chart(const Chart& chart, PictureFormat format);

/// Grey for a series that others are compared with.
inline constexpr Colour comparison_grey{0.38, 0.38, 0.38};

}  // namespace palpate
