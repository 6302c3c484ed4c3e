#include "chart_series.hpp"

#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace palpate::bench {

ChartSeries series_like(std::size_t i, std::string name) {
  constexpr Line lines[] = {Line::solid, Line::dashed, Line::dotted};
  constexpr Mark marks[] = {Mark::circle, Mark::square, Mark::triangle, Mark::diamond};
  return {.name = std::move(name),
          .colour = series(i % series_colours),
          .mark = marks[i % std::size(marks)],
          .line = lines[i % std::size(lines)]};
}

std::vector<ChartPoint> points_of(const Json& records, const char* x, const char* y) {
  const auto number_of = [](const Json& record, const char* field) {
    const Json value = field_of(record, field);
    return value.is_null() ? NAN : value.get<double>();
  };
  std::vector<ChartPoint> points;
  for (const Json& record : records) {
    points.push_back({.x = number_of(record, x), .y = number_of(record, y)});
  }
  return points;
}

ChartAxis percent_axis(std::string label, double upper) {
  return {.label = std::move(label), .lower = 0.0, .upper = upper, .text = [](double fraction) {
            return fmt::format("{:.0f}", 100.0 * fraction);
          }};
}

}  // namespace palpate::bench
