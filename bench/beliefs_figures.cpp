#include <algorithm>
#include <iterator>
#include <tuple>

#include <fmt/format.h>

#include "beliefs_parts.hpp"
#include "chart_series.hpp"
#include "command_run.hpp"
#include "normalised_error.hpp"

namespace palpate::bench {

namespace {

const ChartAxis touches_axis{.label = "touches", .lower = 0.0};

/// An axis that leaves room for the marks at the most touches of the records.
ChartAxis touches_axis_to(const Json& records) {
  ChartAxis axis = touches_axis;
  double most = 0.0;
  for (const Json& record : records) {
    most = std::max(most, record.at("touches").get<double>());
  }
  axis.upper = most + 0.5;
  return axis;
}

Json records_where(const Json& records, const char* field, const Json& value) {
  Json found = Json::array();
  std::ranges::copy_if(records, std::back_inserter(found.get_ref<Json::array_t&>()),
                       [&](const Json& record) { return record.at(field) == value; });
  return found;
}

/// The values of a field, each once, in order.
std::vector<Json> values_of(const Json& records, const char* field) {
  std::vector<Json> values;
  for (const Json& record : records) {
    if (std::ranges::count(values, record.at(field)) == 0) {
      values.push_back(record.at(field));
    }
  }
  return values;
}

/// A mean with its interval over touches: colours tell the noise apart, dashes the beliefs.
Chart misplaced_chart(const Json& records, const std::string& field, ChartAxis y) {
  Chart chart{.title = "standard deviation of the error of the reported sensor pose",
              .x = touches_axis_to(records),
              .y = std::move(y)};
  std::size_t colour = 0;
  for (const Json& noise : values_of(records, "noise_mm")) {
    for (const char* belief : {"as if exact", "averaged"}) {
      const Json of_both =
          records_where(records_where(records, "noise_mm", noise), "belief", belief);
      const bool averaged = belief == std::string("averaged");
      ChartSeries series{.name = fmt::format("{} mm, {} rad, {}", plain_text(noise),
                                             plain_text(of_both.front().at("noise_rad")), belief),
                         .colour = palpate::series(colour),
                         .mark = averaged ? Mark::circle : Mark::square,
                         .fill = averaged ? MarkFill::solid : MarkFill::hollow,
                         .line = averaged ? Line::solid : Line::dashed};
      series.points = points_of(of_both, "/touches", ("/" + field + "/mean").c_str());
      for (std::size_t i = 0; i < series.points.size(); ++i) {
        series.points[i].low = of_both[i].at(field).at("low");
        series.points[i].high = of_both[i].at(field).at("high");
      }
      chart.series.push_back(std::move(series));
    }
    ++colour;
  }
  return chart;
}

Chart sureness_chart(const Json& records) {
  Chart chart = misplaced_chart(
      records, "normalised_error",
      {.label = "squared pose error over covariance (NEES)", .scale = Scale::logarithmic});
  chart.rules.push_back({.at = expected_normalised_error,
                         .colour = comparison_grey,
                         .label = "3 where covariances are right"});
  return chart;
}

/// Shares called none over touches: colours tell the settings apart, dashes who was learned. Larger
/// regions are left to the tables.
Chart none_chart(const Json& records) {
  Chart chart{.x = touches_axis_to(records), .y = percent_axis("called none (%)")};
  std::size_t colour = 0;
  for (const Json& name : values_of(records, "name")) {
    const std::string text = name;
    if (text.starts_with("exact") && !chart.series.empty()) {
      continue;
    }
    for (const auto& [who, field, learned] :
         {std::tuple("never learned", "/unlearned_called_none", false),
          std::tuple("learned", "/learned_called_none", true)}) {
      chart.series.push_back(
          {.name = fmt::format("{}: {}", text, who),
           .colour = palpate::series(colour),
           .mark = learned ? Mark::square : Mark::circle,
           .fill = learned ? MarkFill::hollow : MarkFill::solid,
           .line = learned ? Line::dashed : Line::solid,
           .points = points_of(records_where(records, "name", name), "/touches", field)});
    }
    ++colour;
  }
  return chart;
}

Chart slip_chart(const Json& records) {
  Chart chart{.x = touches_axis,
              .y = {.label = "mean error of modes with the right letter (mm)",
                    .scale = Scale::logarithmic}};
  for (const Json& record : records) {
    ChartSeries series = series_like(chart.series.size(), record.at("belief"));
    series.mark_every = 5;
    series.points = points_of(record.at("curve"), "/touches", "/mode_mm");
    chart.series.push_back(std::move(series));
  }
  return chart;
}

Chart plan_chart(const Json& records) {
  Chart chart{.x = touches_axis_to(records.front().at("curve")),
              .y = {.label = "entropy of the belief (nats)", .lower = 0.0}};
  for (const Json& record : records) {
    ChartSeries series = series_like(chart.series.size(), record.at("order"));
    series.points = points_of(record.at("curve"), "/touches", "/entropy/mean");
    for (std::size_t i = 0; i < series.points.size(); ++i) {
      series.points[i].low = record.at("curve")[i].at("entropy").at("low");
      series.points[i].high = record.at("curve")[i].at("entropy").at("high");
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

std::vector<Chart> charts_of(const std::string& part, const Json& records) {
  if (part == "misplaced") {
    return {misplaced_chart(records, "refined_mm",
                            {.label = "mean error of refined poses with the right letter (mm)",
                             .scale = Scale::logarithmic}),
            sureness_chart(records)};
  }
  if (part == "none") {
    return {none_chart(records)};
  }
  if (part == "slip") {
    return {slip_chart(records)};
  }
  if (part == "plan") {
    return {plan_chart(records)};
  }
  return {};
}

}  // namespace

std::vector<const char*> belief_figures(const std::string& part) {
  if (part == "misplaced") {
    return {"misplaced", "sureness"};
  }
  if (part == "touch-sd" || part == "cost") {
    return {};
  }
  return {*std::ranges::find(belief_parts, part)};
}

void draw_belief_figures(const std::string& part, const Json& records,
                         const std::filesystem::path& folder) {
  write_charts(charts_of(part, records), folder, belief_figures(part));
}

}  // namespace palpate::bench
