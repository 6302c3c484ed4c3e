#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "chart.hpp"
#include "chart_file.hpp"
#include "comparison.hpp"
#include "experiment_result.hpp"
#include "published.hpp"

namespace palpate::bench {

namespace {

using Value = std::function<double(const CurvePoint&)>;

double accuracy_percent(const CurvePoint& point) { return 100.0 * point.accuracy; }
double mean_error_mm(const CurvePoint& point) { return point.error ? point.error->mean_mm : NAN; }
double refined_error_mm(const CurvePoint& point) {
  return point.refined_error ? point.refined_error->mean_mm : NAN;
}

/// The look of the i-th series: told apart by mark and dashes as well as by colour.
ChartSeries series_like(std::size_t i, std::string name) {
  constexpr Line lines[] = {Line::solid, Line::dashed, Line::dotted};
  constexpr Mark marks[] = {Mark::circle, Mark::square, Mark::triangle, Mark::diamond};
  return {.name = std::move(name),
          .colour = series(i % series_colours),
          .mark = marks[i % std::size(marks)],
          .line = lines[i % std::size(lines)]};
}

/// A run over its touches, with the mark at every fifth so that the dashes show between them.
ChartSeries curve(const FilterRun& run, const Value& value, ChartSeries like) {
  like.mark_every = 5;
  for (const CurvePoint& point : curve_of(run)) {
    like.points.push_back({.x = static_cast<double>(point.touches), .y = value(point)});
  }
  return like;
}

/// One series for every run of a filter.
void add_runs(Chart& chart, const ExperimentResult& result, const std::string& filter,
              const Value& value, std::optional<Line> line = {}) {
  std::size_t i = 0;
  for (const FilterRun& run : result.runs) {
    if (run.filter == filter) {
      ChartSeries like = series_like(i++, run.name);
      like.line = line.value_or(like.line);
      chart.series.push_back(curve(run, value, std::move(like)));
    }
  }
}

Chart chart_over_touches(ChartAxis y) {
  return {.x = {.label = "touches", .lower = 0.0}, .y = std::move(y)};
}

ChartAxis percent_axis(std::string label) {
  return {.label = std::move(label), .lower = 0.0, .upper = 105.0};
}

ChartAxis error_axis(std::string label, double lower_mm, double upper_mm) {
  return {
      .label = std::move(label), .scale = Scale::logarithmic, .lower = lower_mm, .upper = upper_mm};
}

constexpr const char* mean_error = "mean pose error where the letter is right (mm)";

Chart error_chart_of(const ExperimentResult& result, const std::string& filter) {
  Chart chart = chart_over_touches({.label = mean_error, .lower = 0.0});
  add_runs(chart, result, filter, mean_error_mm);
  return chart;
}

/// With the 95 % interval as a light band along every curve.
Chart accuracy_chart_of(const ExperimentResult& result, const std::string& filter) {
  Chart chart =
      chart_over_touches(percent_axis("trials with the right letter, and 95 % interval (%)"));
  std::size_t i = 0;
  for (const FilterRun& run : result.runs) {
    if (run.filter != filter) {
      continue;
    }
    ChartSeries series = curve(run, accuracy_percent, series_like(i++, run.name));
    series.interval = IntervalShape::band;
    const std::vector<CurvePoint> points = curve_of(run);
    for (std::size_t k = 0; k < points.size(); ++k) {
      series.points[k].low = 100.0 * points[k].accuracy_interval.low;
      series.points[k].high = 100.0 * points[k].accuracy_interval.high;
    }
    chart.series.push_back(std::move(series));
  }
  return chart;
}

void draw_paper_figures(const ExperimentResult& result, const std::filesystem::path& folder) {
  Chart fig6a = accuracy_chart_of(result, "particles");
  fig6a.rules.push_back({.at = 100.0 * published::particle_accuracy,
                         .colour = comparison_grey,
                         .label = "paper: 10,000 particles level out"});
  write_chart(fig6a, folder, "fig6a");
  write_chart(error_chart_of(result, "particles"), folder, "fig6b");

  Chart fig7a = accuracy_chart_of(result, "histogram");
  const auto reached = [&](const char* name, Mark mark, int touches) {
    fig7a.series.push_back({.name = name,
                            .colour = comparison_grey,
                            .mark = mark,
                            .points = {{.x = static_cast<double>(touches), .y = 100.0}}});
  };
  reached("paper: 1,000 bins reach 100 %", Mark::cross, published::bins_1000_know_after);
  reached("paper: 10,000 bins reach 100 %", Mark::diamond, published::bins_10000_know_after);
  write_chart(fig7a, folder, "fig7a");
  Chart fig7b = error_chart_of(result, "histogram");
  fig7b.rules.push_back(
      {.at = published::error_mm, .colour = comparison_grey, .label = "paper: 1.3 mm"});
  write_chart(fig7b, folder, "fig7b");
}

/// The largest size of a filter.
std::int64_t most_of(const ExperimentResult& result, const std::string& filter) {
  std::int64_t most = 0;
  for (const FilterRun& run : result.runs) {
    most = run.filter == filter ? std::max(most, run.count) : most;
  }
  return most;
}

/// Plain and Augmented MCL, in the same colours.
Chart augmented_chart(const ExperimentResult& result) {
  Chart chart = chart_over_touches(percent_axis("trials with the right letter (%)"));
  add_runs(chart, result, "particles", accuracy_percent, Line::solid);
  add_runs(chart, result, "augmented", accuracy_percent, Line::dashed);
  return chart;
}

/// Mean, median, 95th percentile and refined error of the finest histogram.
Chart errors_chart(const ExperimentResult& result) {
  const auto finest =
      std::find_if(result.runs.begin(), result.runs.end(), [&](const FilterRun& run) {
        return run.filter == "histogram" && run.count == most_of(result, "histogram");
      });
  Chart chart =
      chart_over_touches(error_axis("pose error where the letter is right (mm)", 0.3, 30.0));
  chart.title = finest->name;
  const auto add = [&](double ErrorSummary::*field, std::optional<ErrorSummary> CurvePoint::*of,
                       const char* name) {
    const auto value = [=](const CurvePoint& point) {
      return point.*of ? *(point.*of).*field : NAN;
    };
    chart.series.push_back(curve(*finest, value, series_like(chart.series.size(), name)));
  };
  add(&ErrorSummary::mean_mm, &CurvePoint::error, "mode, mean");
  add(&ErrorSummary::p95_mm, &CurvePoint::error, "mode, 95th percentile");
  add(&ErrorSummary::median_mm, &CurvePoint::error, "mode, median");
  add(&ErrorSummary::p95_mm, &CurvePoint::refined_error, "refined, 95th percentile");
  add(&ErrorSummary::mean_mm, &CurvePoint::refined_error, "refined, mean");
  return chart;
}

/// The mode's error beside the refined pose's, of the histograms with the most bins.
Chart refined_chart(const ExperimentResult& result) {
  Chart chart = chart_over_touches(error_axis(mean_error, 0.2, 20.0));
  for (const FilterRun& run : result.runs) {
    if (run.filter == "histogram" && as_many(run.count, most_of(result, "histogram"))) {
      const auto add = [&](const Value& value, const char* kind) {
        chart.series.push_back(
            curve(run, value, series_like(chart.series.size(), run.name + kind)));
      };
      add(mean_error_mm, ", mode");
      add(refined_error_mm, ", refined");
    }
  }
  return chart;
}

/// Pose errors with the array where it is reported and off by each noise, for the largest counts:
/// colours tell the noise apart, dashes the filters.
Chart pose_noise_chart(const ExperimentResult& result) {
  const std::vector<FilterRun>& noisy = result.pose_noise.front().runs;
  Chart chart = chart_over_touches(error_axis(mean_error, 0.3, 20.0));
  chart.x.upper = static_cast<double>(noisy.front().records.front().trace.size());
  bool first = true;
  for (const FilterRun& filter : noisy) {
    if (filter.count != most_of(result, filter.filter)) {
      continue;
    }
    std::size_t colour = 0;
    const auto add = [&](const std::vector<FilterRun>& runs, const std::string& noise) {
      const auto run = std::find_if(runs.begin(), runs.end(), [&](const FilterRun& candidate) {
        return candidate.name == filter.name;
      });
      chart.series.push_back(curve(*run, mean_error_mm,
                                   {.name = fmt::format("{}, {}", filter.name, noise),
                                    .colour = series(colour++),
                                    .mark = first ? Mark::circle : Mark::square,
                                    .fill = first ? MarkFill::solid : MarkFill::hollow,
                                    .line = first ? Line::solid : Line::dashed}));
    };
    add(result.runs, "exact");
    for (const PoseNoiseRuns& runs : result.pose_noise) {
      add(runs.runs,
          fmt::format("{} mm, {} rad", runs.noise.translation_mm, runs.noise.rotation_rad));
    }
    first = false;
  }
  return chart;
}

Chart calibration_chart(const ExperimentResult& result) {
  constexpr int fewest = 10;  // estimates of which a fraction says something
  Chart chart{.title = fmt::format("at least {} estimates per point", fewest),
              .x = {.label = "confidence: probability of the most probable letter (%)",
                    .lower = 0.0,
                    .upper = 100.0},
              .y = percent_axis("estimates that are right (%)")};
  chart.series.push_back({.name = "as sure as right",
                          .colour = comparison_grey,
                          .mark = Mark::none,
                          .line = Line::dotted,
                          .points = {{.x = 0.0, .y = 0.0}, {.x = 100.0, .y = 100.0}}});
  for (const FilterRun& run : result.runs) {
    const bool shown = run.filter == "histogram" ||
                       (run.filter == "particles" && run.count == most_of(result, "particles"));
    if (!shown) {
      continue;  // all nine would hide more than they show
    }
    const Calibration calibration = calibration_of(run);
    ChartSeries points =
        series_like(chart.series.size() - 1,
                    fmt::format("{}, {:.1f} % off", run.name, 100.0 * calibration.expected_error));
    for (const Calibration::Bin& bin : calibration.bins) {
      if (bin.count >= fewest) {
        points.points.push_back(
            {.x = 100.0 * bin.mean_confidence, .y = 100.0 * bin.fraction_right});
      }
    }
    chart.series.push_back(std::move(points));
  }
  return chart;
}

Chart none_chart(const ExperimentResult& result) {
  Chart chart{
      .x = {.label = "log10 of the prior weight of \"none of these\", each letter having 1"},
      .y = percent_axis("unknowns called \"none of these\" (%)")};
  std::size_t colour = 0;
  for (const NoneRun& run : result.none) {
    const auto add = [&](const char* who, double (NoneRun::*share)(double) const, Line line) {
      ChartSeries curve = series_like(colour, fmt::format("{}, {} touches", who, run.touches));
      curve.line = line;
      curve.mark_every = 10;
      for (const double log10_weight : sampled_log10_weights(result.none)) {
        curve.points.push_back({.x = log10_weight, .y = 100.0 * (run.*share)(log10_weight)});
      }
      chart.series.push_back(std::move(curve));
    };
    add("never learned", &NoneRun::noticed, Line::solid);
    add("learned", &NoneRun::lost, Line::dashed);
    ++colour;
  }
  return chart;
}

}  // namespace

std::vector<std::string> figure_files() {
  std::vector<std::string> files;
  for (const char* name : {"fig6a", "fig6b", "fig7a", "fig7b", "augmented", "errors", "refined",
                           "pose_noise", "calibration", "none"}) {
    std::ranges::copy(chart_files(name), std::back_inserter(files));
  }
  return files;
}

void draw_figures(const ExperimentResult& result, const std::filesystem::path& folder) {
  draw_paper_figures(result, folder);
  write_chart(augmented_chart(result), folder, "augmented");
  write_chart(errors_chart(result), folder, "errors");
  write_chart(refined_chart(result), folder, "refined");
  write_chart(pose_noise_chart(result), folder, "pose_noise");
  write_chart(calibration_chart(result), folder, "calibration");
  write_chart(none_chart(result), folder, "none");
}

}  // namespace palpate::bench
