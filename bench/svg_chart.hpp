#pragma once

#include <functional>
#include <string>
#include <vector>

namespace palpate::bench {

enum class Shape { circle, square, triangle, diamond };
enum class Fill { solid, half, none };

struct ChartPoint {
  double x = 0.0;
  double y = 0.0;
  std::string label;  ///< drawn beside it where there is room; empty for none
  std::string title;  ///< shown under the pointer
};

struct ChartSeries {
  std::string name;  ///< in the legend; empty to leave it out
  int colour = 0;    ///< 0 to 5, of the colours of chart_style()
  Shape shape = Shape::circle;
  Fill fill = Fill::solid;
  bool line = false;  ///< joins the points, in their order
  bool dashed = false;
  bool marks = true;
  std::vector<ChartPoint> points = {};
};

/// A straight line across the chart.
struct ChartRule {
  bool vertical = false;
  double at = 0.0;
  int colour = 0;
  std::string label;
};

/// A chart with two logarithmic axes, which span their points and rules. Points that are not
/// positive and finite are left out.
struct Chart {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::function<std::string(double)> x_tick;  ///< text of a number on the axis
  std::function<std::string(double)> y_tick;
  std::vector<ChartSeries> series = {};
  std::vector<ChartRule> rules = {};
};

/// The chart as an SVG element, for a page that has chart_style().
std::string svg_of(const Chart& chart);
/// The chart as a file by itself, on a light ground.
std::string svg_file(const Chart& chart);

/// Text as it may stand in XML, between tags or in quotes.
std::string xml_escaped(const std::string& text);

}  // namespace palpate::bench
