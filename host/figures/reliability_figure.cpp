#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "figures/chart.hpp"
#include "figures/figures.hpp"

namespace palpate {

std::string draw_reliability(const ReliabilityFigure& figure) {
  const auto axis = [](const char* label) {
    // The ends leave room for the marks at 0 and 1.
    return ChartAxis{.label = label, .lower = -0.02, .upper = 1.05};
  };
  Chart chart{.title = "confidence and accuracy; numbers count records, bars are 95 % intervals",
              .x = axis("mean probability of the best label"),
              .y = axis("share of records that are right")};
  chart.series.push_back({.name = "confidence = accuracy",
                          .colour = comparison_grey,
                          .mark = Mark::none,
                          .line = Line::dotted,
                          .points = {{.x = 0.0, .y = 0.0}, {.x = 1.0, .y = 1.0}}});
  constexpr std::array marks{Mark::circle, Mark::square};
  for (std::size_t k = 0; k < figure.curves.size(); ++k) {
    ChartSeries series{.name = figure.curves[k].name,
                       .colour = palpate::series(k),
                       .mark = marks[k % marks.size()]};
    // Few records say little, beside others or alone: their marks are small, and their long
    // intervals faint.
    const auto& points = figure.curves[k].points;
    std::size_t many = 40;
    for (const ReliabilityFigure::Point& point : points) {
      many = std::max(many, point.records);
    }
    for (const ReliabilityFigure::Point& point : points) {
      const double part = static_cast<double>(point.records) / static_cast<double>(many);
      series.points.push_back({.x = point.confidence,
                               .y = point.accuracy,
                               .low = point.low,
                               .high = point.high,
                               .label = fmt::format("{}", point.records),
                               .size = std::clamp(2.0 * std::sqrt(part), 0.45, 1.0)});
    }
    chart.series.push_back(std::move(series));
  }
  return draw_chart(chart);
}

}  // namespace palpate
