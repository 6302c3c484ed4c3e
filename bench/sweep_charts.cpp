#include <algorithm>
#include <string_view>
#include <tuple>

#include <fmt/format.h>

#include "sweep_document.hpp"
#include "sweep_page.hpp"

namespace palpate::bench {

namespace {

ChartAxis log_axis(std::string label, std::function<std::string(double)> text = {}) {
  return {.label = std::move(label), .scale = Scale::logarithmic, .text = std::move(text)};
}

/// What stands under the pointer: a line for every column that the record has.
std::string title_of(Columns columns, const Json& record) {
  std::string title;
  const std::vector<std::string> texts = texts_of(columns, record, "");
  for (std::size_t i = 0; i < columns.size(); ++i) {
    title += texts[i].empty() ? "" : fmt::format("{}: {}\n", columns[i].head, texts[i]);
  }
  return title;
}

void add(Chart& chart, ChartSeries series) {
  if (!series.points.empty()) {
    chart.series.push_back(std::move(series));
  }
}

ChartSeries front_series(const Json& front) {
  ChartSeries series{
      .name = "Pareto front", .colour = comparison_grey, .mark = Mark::none, .line = Line::solid};
  for (const Json& entry : front) {
    series.points.push_back({.x = entry.at("cost"), .y = entry.at("error")});
  }
  return series;
}

Chart pose_chart(const Json& document) {
  Chart chart{.x = log_axis(fmt::format("time per unknown of {} touches, an estimate after each",
                                        plain_text(document.at("touches"))),
                            seconds_text),
              .y = log_axis("mean pose error (mm)"),
              .series = {front_series(document.at("fronts").at(pose_front))}};
  struct Kind {
    std::string_view filter;
    std::string_view pose;
    const char* name;
    Mark mark;
    bool labelled;  ///< the refined pose stands right below its mode, and particles by their like
  };
  constexpr Kind kinds[] = {{"histogram", "mode", "histogram, mode", Mark::circle, false},
                            {"histogram", "refined", "histogram, refined", Mark::square, true},
                            {"particles", "mode", "particles", Mark::triangle, true},
                            {"augmented", "mode", "Augmented MCL", Mark::diamond, false},
                            {"systematic", "mode", "systematic resampling", Mark::triangle, false}};
  constexpr std::pair<double, MarkFill> fills[] = {
      {0.25, MarkFill::pale}, {0.5, MarkFill::solid}, {1.0, MarkFill::hollow}};
  std::size_t colour = 0;
  for (const Kind& kind : kinds) {
    for (const auto& [cell_mm, fill] : fills) {
      ChartSeries series{.name = cell_mm == 0.5 ? kind.name : "",
                         .colour = palpate::series(colour),
                         .mark = kind.mark,
                         .fill = fill};
      for (const auto& [point, pose, error_mm, seconds] : posed_errors(document.at("points"))) {
        if (point.at("filter") == kind.filter && pose == kind.pose &&
            point.at("cell_mm") == cell_mm) {
          series.points.push_back(
              {.x = seconds,
               .y = error_mm.at("mean"),
               .label = kind.labelled && cell_mm == 0.5 ? count_text(point.at("count")) : "",
               .title = fmt::format("{}\n{}", kind.name, title_of(run_columns(), point))});
        }
      }
      add(chart, std::move(series));
    }
    ++colour;
  }
  return chart;
}

Chart precision_chart(const Json& document) {
  Chart chart{.x = log_axis("time per pose, element and touch (ns)"),
              .y = log_axis("largest deviation from float64 (nats)",
                            [](double nats) { return fmt::format("{:.0e}", nats); }),
              .series = {front_series(document.at("fronts").at(precision_front))}};
  struct Family {
    const char* path;  ///< how its paths begin
    const char* name;
    Mark mark;
  };
  constexpr Family families[] = {{"register tiles", "register tiles", Mark::square},
                                 {"runs", "runs of bins", Mark::circle},
                                 {"in logs", "in logs (gamma = 0)", Mark::circle},
                                 {"array at rest", "array at rest", Mark::square},
                                 {"one-bin", "one-bin kernel", Mark::triangle},
                                 {"CPU loop", "CPU loop", Mark::diamond}};
  std::size_t colour = 0;
  for (const Family& family : families) {
    ChartSeries series{
        .name = family.name, .colour = palpate::series(colour++), .mark = family.mark};
    for (const Json& precision : document.at("precisions")) {
      if (plain_text(precision.at("path")).starts_with(family.path)) {
        series.points.push_back({.x = precision.at("nanoseconds"),
                                 .y = precision.at("deviation_nats").at("largest"),
                                 .label = count_text(precision.at("count")),
                                 .title = title_of(precision_columns(), precision)});
      }
    }
    add(chart, std::move(series));
  }
  return chart;
}

Chart bounds_chart(const Json& document) {
  const Json& bounds = document.at("bounds");
  Chart chart{.x = log_axis("bins in all", count_text),
              .y = log_axis(
                  fmt::format("time per unknown of {} touches", plain_text(document.at("touches"))),
                  seconds_text),
              .rules = {{.vertical = true,
                         .at = document.at("auto_rule").at("rule"),
                         .colour = comparison_grey,
                         .label = "--filter auto"}}};
  std::size_t colour = 0;
  for (const auto& [filter, name] :
       {std::pair("histogram", "histogram"), std::pair("bounded", "by bounds")}) {
    for (const auto& [field, asked, once] :
         {std::tuple("once", "asked once", true),
          std::tuple("each_touch", "asked after each touch", false)}) {
      ChartSeries series{.name = fmt::format("{}, {}", name, asked),
                         .colour = palpate::series(colour),
                         .mark = once ? Mark::circle : Mark::square,
                         .fill = once ? MarkFill::solid : MarkFill::hollow,
                         .line = once ? Line::solid : Line::dashed};
      for (const Json& record : bounds) {
        series.points.push_back({.x = record.at("bins_in_all"),
                                 .y = record.at(filter).at(field),
                                 .title = title_of(bounds_columns(), record)});
      }
      add(chart, std::move(series));
    }
    ++colour;
  }
  return chart;
}

Chart knee_chart(const Json& document) {
  Chart chart{.x = log_axis("bins per object", count_text), .y = log_axis("mean pose error (mm)")};
  ChartSeries nearest{
      .name = "nearest bin", .colour = comparison_grey, .mark = Mark::none, .line = Line::dashed};
  const Json* floor = nullptr;
  std::size_t colour = 0;
  for (const Json& knee : document.at("knees")) {
    const Json& cell_mm = knee.at("cell_mm");
    const std::string cells = plain_text(cell_mm);
    const Colour own = palpate::series(colour++);
    ChartSeries mode{.name = cells + " mm cells, mode", .colour = own, .line = Line::solid};
    ChartSeries refined{.name = cells + " mm, refined",
                        .colour = own,
                        .mark = Mark::square,
                        .fill = MarkFill::hollow,
                        .line = Line::solid};
    double finest = 0.0;
    for (const auto& [point, pose, error_mm, seconds] : posed_errors(document.at("points"))) {
      if (point.at("balanced") == false || point.at("cell_mm") != cell_mm) {
        continue;
      }
      const bool is_mode = pose == std::string_view("mode");
      finest = std::max<double>(finest, point.at("count"));
      (is_mode ? mode : refined)
          .points.push_back({.x = point.at("count"),
                             .y = error_mm.at("mean"),
                             .title = title_of(run_columns(), point)});
      if (is_mode && cell_mm == 0.5) {
        nearest.points.push_back({.x = point.at("count"), .y = point.at("nearest_bin_mm")});
      }
    }
    if (const double balanced = knee.at("balanced_count"); balanced <= 2.0 * finest) {
      chart.rules.push_back(
          {.vertical = true, .at = balanced, .colour = own, .label = "fine, " + cells + " mm"});
    }
    chart.series.push_back(std::move(mode));
    chart.series.push_back(std::move(refined));
    const Json& left = knee.at("floor_mm");
    if (!left.is_null() && (floor == nullptr || left.at("mean") < floor->at("mean"))) {
      floor = &left;
    }
  }
  if (floor != nullptr) {
    chart.rules.push_back({.vertical = false,
                           .at = floor->at("mean"),
                           .colour = comparison_grey,
                           .label = fmt::format("least error {} mm, {} trials", mean_text(*floor),
                                                plain_text(floor->at("trials")))});
  }
  chart.series.push_back(std::move(nearest));
  return chart;
}

}  // namespace

std::vector<Chart> charts_of(const Json& document) {
  return {pose_chart(document), precision_chart(document), knee_chart(document),
          bounds_chart(document)};
}

}  // namespace palpate::bench
