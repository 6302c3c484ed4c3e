#include <fmt/format.h>

#include "chart_series.hpp"
#include "own_sweep.hpp"

namespace palpate::bench {

namespace {

ChartAxis log_axis(std::string label, std::function<std::string(double)> text = {}) {
  return {.label = std::move(label), .scale = Scale::logarithmic, .text = std::move(text)};
}

ChartSeries line_of(std::size_t i, const char* name, const Json& points, const char* field) {
  ChartSeries series = series_like(i, name);
  series.points = points_of(points, "/count", field);
  return series;
}

Chart error_chart(const Json& document) {
  const Json& points = document.at("points");
  const bool truth_known = document.at("true_poses") > 0;
  Chart chart{
      .x = log_axis("bins per object", count_text),
      .y = log_axis(truth_known ? "mean pose error (mm)"
                                : "mean distance from the pose of the finest bins (mm)"),
      .series = {
          line_of(0, "mode", points, truth_known ? "/error_mm/mean" : "/from_finest_mm/mean"),
          line_of(1, "refined pose", points,
                  truth_known ? "/refined_error_mm/mean" : "/refined_from_finest_mm/mean")}};
  ChartSeries sd = line_of(2, "standard deviation of x and y, median", points, "/sd_mm");
  sd.colour = comparison_grey;
  sd.mark = Mark::none;
  chart.series.push_back(std::move(sd));
  for (const auto& [field, label] :
       {std::pair("auto_count", "--bins auto"), std::pair("fine_count", "--bins fine")}) {
    const double at = document.at(field);
    if (at >= points.front().at("count") && at <= points.back().at("count")) {
      chart.rules.push_back(
          {.vertical = true, .at = at, .colour = comparison_grey, .label = label});
    }
  }
  if (const Json& at = document.at("refined_count"); !at.is_null()) {
    chart.rules.push_back({.vertical = true, .at = at, .colour = ink, .label = "enough"});
  }
  return chart;
}

Chart time_chart(const Json& document) {
  const Json& points = document.at("points");
  return {.x = log_axis("bins per object", count_text),
          .y = log_axis("time per unknown", seconds_text),
          .series = {line_of(0, "histogram", points, "/seconds_histogram"),
                     line_of(1, "by bounds", points, "/seconds_bounds")}};
}

}  // namespace

std::vector<Chart> own_charts_of(const Json& document) {
  return {error_chart(document), time_chart(document)};
}

}  // namespace palpate::bench
