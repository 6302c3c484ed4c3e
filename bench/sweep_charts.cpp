#include <algorithm>
#include <functional>
#include <iterator>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "chart.hpp"
#include "sweep_result.hpp"
#include "sweep_words.hpp"

namespace palpate::bench {

namespace {

std::string nats_text(double nats) { return fmt::format("{:.0e}", nats); }

ChartAxis log_axis(std::string label, std::function<std::string(double)> text = {}) {
  return {.label = std::move(label), .scale = Scale::logarithmic, .text = std::move(text)};
}

std::string size_of(const SweepPoint& point) {
  return count_text(static_cast<double>(point.count));
}

std::string title_of(const PosedError& posed) {
  const SweepPoint& point = *posed.point;
  const std::string bins =
      point.filter == "histogram"
          ? fmt::format("{} x {} x {} bins", point.bins[0], point.bins[1], point.bins[2])
          : fmt::format("{} particles", point.count);
  const std::string p95 =
      posed.errors.p95_mm ? fmt::format(", 95th percentile {:.3f}", *posed.errors.p95_mm) : "";
  return fmt::format(
      "{}, {}, {}, cells of {} mm: mean {} mm, median {:.3f}{}, over {} trials{}; "
      "{:.0f} % of {} recognised; {} per unknown",
      point.filter, posed.kind == PoseKind::refined ? "refined pose" : "mode", bins, point.cell_mm,
      mean_text(posed.errors), posed.errors.median_mm, p95, posed.errors.trials,
      point.window ? " in windows" : "", 100.0 * point.accuracy, point.full_trials,
      seconds_text(posed.seconds));
}

MarkFill fill_of(double cell_mm) {
  return cell_mm < 0.4 ? MarkFill::pale : cell_mm < 0.75 ? MarkFill::solid : MarkFill::hollow;
}

/// A series for every filter and kind of pose, the cell sizes told by their fill.
std::vector<ChartSeries> filter_series(const SweepResult& result) {
  struct Kind {
    const char* filter;
    PoseKind pose;
    const char* name;
    Mark mark;
  };
  constexpr Kind kinds[] = {
      {"histogram", PoseKind::mode, "histogram, mode", Mark::circle},
      {"histogram", PoseKind::refined, "histogram, refined", Mark::square},
      {"particles", PoseKind::mode, "particles", Mark::triangle},
      {"augmented", PoseKind::mode, "Augmented MCL", Mark::diamond},
      {"systematic", PoseKind::mode, "systematic resampling", Mark::triangle}};
  const std::vector<PosedError> all = posed_errors(result);
  std::vector<ChartSeries> series;
  for (std::size_t colour = 0; colour < std::size(kinds); ++colour) {
    const Kind& kind = kinds[colour];
    for (const double cell_mm : {0.25, 0.5, 1.0}) {
      ChartSeries one{.name = cell_mm == 0.5 ? kind.name : "",
                      .colour = palpate::series(colour),
                      .mark = kind.mark,
                      .fill = fill_of(cell_mm)};
      // The refined pose stands right below its mode, and particles by their like: one label.
      const bool labelled = cell_mm == 0.5 && (kind.pose == PoseKind::refined ||
                                               std::string_view(kind.filter) == "particles");
      for (const PosedError& posed : all) {
        if (posed.point->filter == kind.filter && posed.kind == kind.pose &&
            posed.point->cell_mm == cell_mm) {
          one.points.push_back({.x = posed.seconds,
                                .y = posed.errors.mean_mm,
                                .label = labelled ? size_of(*posed.point) : "",
                                .title = title_of(posed)});
        }
      }
      if (!one.points.empty()) {
        series.push_back(std::move(one));
      }
    }
  }
  return series;
}

Chart pose_chart(const SweepResult& result) {
  Chart chart{.x = log_axis(fmt::format("time per unknown of {} touches, an estimate after each",
                                        result.touches),
                            seconds_text),
              .y = log_axis("mean pose error (mm)")};
  ChartSeries front{
      .name = "front", .colour = comparison_grey, .mark = Mark::none, .line = Line::solid};
  for (const PosedError& posed : pose_front(result)) {
    front.points.push_back({.x = posed.seconds, .y = posed.errors.mean_mm});
  }
  chart.series.push_back(std::move(front));
  for (ChartSeries& series : filter_series(result)) {
    chart.series.push_back(std::move(series));
  }
  return chart;
}

struct Family {
  const char* begin;  ///< of the path's description
  const char* name;
  Mark mark;
};
constexpr Family families[] = {{"register tiles", "register tiles", Mark::square},
                               {"runs", "rows", Mark::circle},
                               {"in logs", "in logs", Mark::circle},
                               {"array at rest", "array at rest", Mark::square},
                               {"one-bin", "one-bin kernel", Mark::triangle},
                               {"CPU loop", "CPU loop", Mark::diamond}};

Chart precision_chart(const SweepResult& result) {
  Chart chart{.x = log_axis("time per pose, element and touch (ns)"),
              .y = log_axis("largest deviation from float64 (nats)", nats_text)};
  ChartSeries front{
      .name = "front", .colour = comparison_grey, .mark = Mark::none, .line = Line::solid};
  for (const Precision& precision : precision_front(result)) {
    front.points.push_back({.x = precision.nanoseconds, .y = precision.deviation.largest});
  }
  chart.series.push_back(std::move(front));
  for (std::size_t colour = 0; colour < std::size(families); ++colour) {
    const Family& family = families[colour];
    ChartSeries series{.name = family.name, .colour = palpate::series(colour), .mark = family.mark};
    for (const Precision& precision : result.precisions) {
      if (precision.path.starts_with(family.begin)) {
        series.points.push_back(
            {.x = precision.nanoseconds,
             .y = precision.deviation.largest,
             .label = count_text(static_cast<double>(precision.count)),
             .title = fmt::format("{}, {} poses: {:.3g} ns; largest {:.2e}, RMS {:.2e} nats",
                                  precision.path, precision.count, precision.nanoseconds,
                                  precision.deviation.largest, precision.deviation.rms)});
      }
    }
    if (!series.points.empty()) {
      chart.series.push_back(std::move(series));
    }
  }
  return chart;
}

Chart knee_chart(const SweepResult& result) {
  Chart chart{.x = log_axis("bins per object", count_text), .y = log_axis("mean pose error (mm)")};
  ChartSeries nearest{
      .name = "nearest bin", .colour = comparison_grey, .mark = Mark::none, .line = Line::dashed};
  std::size_t colour = 0;
  for (const CellFinding& finding : result.findings) {
    ChartSeries mode{.name = fmt::format("{} mm cells, mode", finding.cell_mm),
                     .colour = palpate::series(colour),
                     .mark = Mark::circle,
                     .line = Line::solid};
    ChartSeries refined{.name = fmt::format("{} mm, refined", finding.cell_mm),
                        .colour = palpate::series(colour),
                        .mark = Mark::square,
                        .fill = MarkFill::hollow,
                        .line = Line::solid};
    const std::vector<SweepPoint> runs = histograms_of(result, finding.cell_mm);
    for (const PosedError& posed : posed_errors(result)) {
      if (posed.point->balanced && posed.point->cell_mm == finding.cell_mm) {
        (posed.kind == PoseKind::mode ? mode : refined)
            .points.push_back({.x = static_cast<double>(posed.point->count),
                               .y = posed.errors.mean_mm,
                               .title = title_of(posed)});
      }
    }
    if (finding.cell_mm == 0.5) {
      for (const SweepPoint& run : runs) {
        nearest.points.push_back({.x = static_cast<double>(run.count), .y = *run.nearest_bin_mm});
      }
    }
    const auto balanced = static_cast<double>(finding.balanced_count);
    if (balanced <= 2.0 * static_cast<double>(runs.back().count)) {
      chart.rules.push_back({.vertical = true,
                             .at = balanced,
                             .colour = palpate::series(colour),
                             .label = fmt::format("auto, {} mm", finding.cell_mm)});
    }
    chart.series.push_back(std::move(mode));
    chart.series.push_back(std::move(refined));
    ++colour;
  }
  const CellFinding* least = nullptr;
  for (const CellFinding& finding : result.findings) {
    if (finding.floor && (least == nullptr || finding.floor->mean_mm < least->floor->mean_mm)) {
      least = &finding;
    }
  }
  if (least != nullptr) {
    chart.rules.push_back({.vertical = false,
                           .at = least->floor->mean_mm,
                           .colour = comparison_grey,
                           .label = fmt::format("floor {} mm, {} trials", mean_text(least->floor),
                                                least->floor->trials)});
  }
  chart.series.push_back(std::move(nearest));
  return chart;
}

}  // namespace

std::vector<NamedChart> charts_of(const SweepResult& result) {
  return {
      {chart_names[0], "Time against pose error", pose_chart(result),
       fmt::format(
           "Labels are bins per object, of which there are five, or particles in all. Solid "
           "marks: maps of 0.5 mm cells; pale: 0.25 mm; hollow: 1 mm. A refined pose "
           "is drawn at the time of all estimates and one refinement after the last. Errors "
           "are over the trials whose mode has the right object; the front is of runs that "
           "recognise and locate all {} trials, where errors are from windows all those in "
           "full; runs of fewer stay out of it.",
           result.trials)},
      {chart_names[1], "Time against numerical error", precision_chart(result),
       fmt::format("The likelihood alone, side by side on the same lattices; labels are bins per "
                   "object. Deviations of the log-likelihood are the largest of {} bins an object "
                   "after one touch. In logs: gamma = 0. The array at rest counts its No Contact "
                   "elements, too, although it skips them.",
                   sampled_bins)},
      {chart_names[2], "Error against bins", knee_chart(result),
       fmt::format("The histogram on lattices of balanced steps, all over the same {} trials. "
                   "\"Nearest bin\" is the least error that any bin of the lattice has: what the "
                   "lattice alone costs. The floor is what is left on the finest lattice. "
                   "Vertical lines: what --bins auto takes for these cells.",
                   result.trials)},
  };
}

}  // namespace palpate::bench
