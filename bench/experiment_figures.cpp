#include <algorithm>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "chart_series.hpp"
#include "command_run.hpp"
#include "experiment_result.hpp"

namespace palpate::bench {

namespace {

constexpr const char* figure_names[] = {"fig6a",   "fig6b",      "fig7a",
                                        "fig7b",   "augmented",  "errors",
                                        "refined", "pose_noise", "calibration"};

const ChartAxis touches_axis{.label = "touches", .lower = 0.0};
constexpr const char* mean_error = "mean pose error of trials with the right letter (mm)";

/// A field of a run over its touches, with the mark at every fifth so that the dashes show between.
ChartSeries curve(const Json& run, const char* field, ChartSeries like) {
  like.mark_every = 5;
  like.points = points_of(run.at("curve"), "/touches", field);
  return like;
}

std::vector<Json> runs_of(const Json& document, const std::string& filter) {
  std::vector<Json> runs;
  std::ranges::copy_if(document.at("filters"), std::back_inserter(runs),
                       [&](const Json& run) { return run.at("filter") == filter; });
  return runs;
}

/// The largest count of a filter's runs.
std::int64_t most_of(const Json& document, const std::string& filter) {
  std::int64_t most = 0;
  for (const Json& run : runs_of(document, filter)) {
    most = std::max<std::int64_t>(most, run.at("count"));
  }
  return most;
}

ChartAxis error_axis(std::string label, double lower_mm, double upper_mm) {
  return {
      .label = std::move(label), .scale = Scale::logarithmic, .lower = lower_mm, .upper = upper_mm};
}

/// A series for each run of a filter.
Chart chart_of_runs(const Json& document, const std::string& filter, const char* field,
                    ChartAxis y) {
  Chart chart{.x = touches_axis, .y = std::move(y)};
  for (const Json& run : runs_of(document, filter)) {
    chart.series.push_back(curve(run, field, series_like(chart.series.size(), run.at("name"))));
  }
  return chart;
}

/// With the 95 % interval as a light band along every curve.
Chart accuracy_chart(const Json& document, const std::string& filter) {
  Chart chart = chart_of_runs(document, filter, "/accuracy",
                              percent_axis("trials with the right letter, and 95 % interval (%)"));
  std::size_t i = 0;
  for (const Json& run : runs_of(document, filter)) {
    ChartSeries& series = chart.series[i++];
    series.interval = IntervalShape::band;
    for (std::size_t k = 0; k < series.points.size(); ++k) {
      series.points[k].low = run.at("curve")[k].at("accuracy_low");
      series.points[k].high = run.at("curve")[k].at("accuracy_high");
    }
  }
  return chart;
}

Chart error_chart(const Json& document, const std::string& filter) {
  return chart_of_runs(document, filter, "/error_mm/mean", {.label = mean_error, .lower = 0.0});
}

Chart fig6a(const Json& document) {
  Chart chart = accuracy_chart(document, "particles");
  chart.rules.push_back({.at = published::particle_accuracy,
                         .colour = comparison_grey,
                         .label = "paper: 10,000 particles level out"});
  return chart;
}

Chart fig7a(const Json& document) {
  Chart chart = accuracy_chart(document, "histogram");
  for (const auto& [name, mark, touches] :
       {std::tuple{"paper: 1,000 bins reach 100 %", Mark::cross, published::bins_1000_know_after},
        std::tuple{"paper: 10,000 bins reach 100 %", Mark::diamond,
                   published::bins_10000_know_after}}) {
    chart.series.push_back({.name = name,
                            .colour = comparison_grey,
                            .mark = mark,
                            .points = {{.x = static_cast<double>(touches), .y = 1.0}}});
  }
  return chart;
}

Chart fig7b(const Json& document) {
  Chart chart = error_chart(document, "histogram");
  chart.rules.push_back(
      {.at = published::error_mm, .colour = comparison_grey, .label = "paper: 1.3 mm"});
  return chart;
}

/// Plain and Augmented MCL, in the same colours.
Chart augmented_chart(const Json& document) {
  const ChartAxis accuracy = percent_axis("trials with the right letter (%)");
  Chart chart = chart_of_runs(document, "particles", "/accuracy", accuracy);
  Chart augmented = chart_of_runs(document, "augmented", "/accuracy", accuracy);
  for (ChartSeries& series : chart.series) {
    series.line = Line::solid;
  }
  for (ChartSeries& series : augmented.series) {
    series.line = Line::dashed;
    chart.series.push_back(std::move(series));
  }
  return chart;
}

/// Mean, median, 95th percentile and refined error of the finest histogram.
Chart errors_chart(const Json& document) {
  Chart chart{.x = touches_axis,
              .y = error_axis("pose error of trials with the right letter (mm)", 0.3, 30.0)};
  for (const Json& run : runs_of(document, "histogram")) {
    if (run.at("count") != most_of(document, "histogram")) {
      continue;
    }
    chart.title = run.at("name");
    for (const auto& [name, field] :
         {std::pair{"mode, mean", "/error_mm/mean"},
          std::pair{"mode, 95th percentile", "/error_mm/p95"},
          std::pair{"mode, median", "/error_mm/median"},
          std::pair{"refined, 95th percentile", "/refined_error_mm/p95"},
          std::pair{"refined, mean", "/refined_error_mm/mean"}}) {
      chart.series.push_back(curve(run, field, series_like(chart.series.size(), name)));
    }
  }
  return chart;
}

/// The mode's mean error beside the refined pose's, of the histograms with the most bins.
Chart refined_chart(const Json& document) {
  Chart chart{.x = touches_axis, .y = error_axis(mean_error, 0.2, 20.0)};
  for (const Json& run : runs_of(document, "histogram")) {
    if (as_many(run.at("count"), most_of(document, "histogram"))) {
      for (const auto& [kind, field] :
           {std::pair{"mode", "/error_mm/mean"}, std::pair{"refined", "/refined_error_mm/mean"}}) {
        chart.series.push_back(
            curve(run, field,
                  series_like(chart.series.size(),
                              fmt::format("{}, {}", plain_text(run.at("name")), kind))));
      }
    }
  }
  return chart;
}

/// Pose errors with the array where it is reported and off by each noise, for the largest counts:
/// colours tell the noise apart, dashes the filters.
Chart pose_noise_chart(const Json& document) {
  Chart chart{.title = "standard deviation of the error of the reported sensor pose",
              .x = touches_axis,
              .y = error_axis(mean_error, 0.3, 20.0)};
  const auto add = [&](const Json& runs, const std::string& filter, const std::string& noise,
                       std::size_t colour) {
    const bool first = filter == "histogram";
    for (const Json& run : runs) {
      if (run.at("filter") == filter && run.at("count") == most_of(document, filter)) {
        chart.series.push_back(
            curve(run, "/error_mm/mean",
                  {.name = fmt::format("{}, {}", plain_text(run.at("name")), noise),
                   .colour = series(colour),
                   .mark = first ? Mark::circle : Mark::square,
                   .fill = first ? MarkFill::solid : MarkFill::hollow,
                   .line = first ? Line::solid : Line::dashed}));
      }
    }
  };
  for (const char* filter : {"histogram", "particles"}) {
    std::size_t colour = 0;
    add(document.at("filters"), filter, "0 mm, 0 rad", colour);
    for (const Json& noisy : document.at("pose_noise")) {
      add(noisy.at("filters"), filter,
          fmt::format("{} mm, {} rad", plain_text(noisy.at("translation_mm")),
                      plain_text(noisy.at("rotation_rad"))),
          ++colour);
      chart.x.upper = static_cast<double>(noisy.at("filters").front().at("curve").size());
    }
  }
  return chart;
}

Chart calibration_chart(const Json& document) {
  constexpr int fewest = 10;  // estimates of which a fraction says something
  Chart chart{
      .title = fmt::format(
          "expected calibration error in brackets; at least {} estimates per point", fewest),
      .x = percent_axis("confidence: probability of the most probable letter (%)", 1.0),
      .y = percent_axis("estimates that are right (%)")};
  chart.series.push_back({.name = "perfectly calibrated",
                          .colour = comparison_grey,
                          .mark = Mark::none,
                          .line = Line::dotted,
                          .points = {{.x = 0.0, .y = 0.0}, {.x = 1.0, .y = 1.0}}});
  std::vector<Json> shown = runs_of(document, "histogram");
  shown.push_back(runs_of(document, "particles").back());  // all would hide more than they show
  for (const Json& run : shown) {
    const Json& calibration = run.at("calibration");
    Json bins = calibration.at("bins");
    std::erase_if(bins.get_ref<Json::array_t&>(),
                  [](const Json& bin) { return bin.at("count") < fewest; });
    ChartSeries series =
        series_like(chart.series.size() - 1,
                    fmt::format("{} ({:.1f} %)", plain_text(run.at("name")),
                                100.0 * calibration.at("expected_error").get<double>()));
    series.points = points_of(bins, "/mean_confidence", "/fraction_right");
    chart.series.push_back(std::move(series));
  }
  return chart;
}

}  // namespace

std::vector<std::string> figure_files() { return chart_files(figure_names); }

void draw_figures(const Json& document, const std::filesystem::path& folder) {
  const Chart charts[] = {
      fig6a(document),         error_chart(document, "particles"), fig7a(document),
      fig7b(document),         augmented_chart(document),          errors_chart(document),
      refined_chart(document), pose_noise_chart(document),         calibration_chart(document)};
  write_charts(charts, folder, figure_names);
}

}  // namespace palpate::bench
