#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "svg_chart.hpp"
#include "sweep_findings.hpp"
#include "sweep_result.hpp"

namespace palpate::bench {

namespace {

constexpr int grey = 5;

std::string mm_text(double mm) { return fmt::format("{:g}", mm); }
std::string ns_text(double ns) { return fmt::format("{:g}", ns); }
std::string nats_text(double nats) { return fmt::format("{:.0e}", nats); }

std::string size_of(const SweepPoint& point) {
  return count_text(static_cast<double>(point.count));
}

std::string title_of(const PosedError& posed) {
  const SweepPoint& point = *posed.point;
  const std::string bins =
      point.filter == "histogram"
          ? fmt::format("{} x {} x {} bins", point.bins[0], point.bins[1], point.bins[2])
          : fmt::format("{} particles", point.count);
  return fmt::format(
      "{}{}, {}, cells of {} mm: mean {:.3f}, median {:.3f}, 95th percentile {:.3f} "
      "mm over {} of {} trials; {} per unknown",
      point.filter, posed.refined ? ", refined pose" : ", mode", bins, point.cell_mm,
      posed.error->mean_mm, posed.error->median_mm, posed.error->p95_mm, point.last.located,
      point.scores.size(), seconds_text(point.seconds_unknown));
}

Fill fill_of(double cell_mm) {
  return cell_mm < 0.4 ? Fill::half : cell_mm < 0.75 ? Fill::solid : Fill::none;
}

/// A series for every filter and kind of pose, the cell sizes told by their fill.
std::vector<ChartSeries> filter_series(const SweepResult& result) {
  struct Kind {
    const char* filter;
    bool refined;
    const char* name;
    Shape shape;
  };
  constexpr Kind kinds[] = {{"histogram", false, "histogram, mode", Shape::circle},
                            {"histogram", true, "histogram, refined", Shape::square},
                            {"particles", false, "particles", Shape::triangle},
                            {"augmented", false, "Augmented MCL", Shape::diamond}};
  const std::vector<PosedError> all = posed_errors(result);
  std::vector<ChartSeries> series;
  for (int colour = 0; colour < static_cast<int>(std::size(kinds)); ++colour) {
    const Kind& kind = kinds[colour];
    for (const double cell_mm : {0.25, 0.5, 1.0}) {
      ChartSeries one{.name = cell_mm == 0.5 ? kind.name : "",
                      .colour = colour,
                      .shape = kind.shape,
                      .fill = fill_of(cell_mm)};
      // The refined pose stands right below its mode: one label for both.
      const bool labelled =
          cell_mm == 0.5 && (kind.refined || std::string_view(kind.filter) != "histogram");
      for (const PosedError& posed : all) {
        if (posed.point->filter == kind.filter && posed.refined == kind.refined &&
            posed.point->cell_mm == cell_mm) {
          one.points.push_back({.x = posed.point->seconds_unknown,
                                .y = posed.error->mean_mm,
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
  Chart chart{.title = "Time against pose error",
              .x_label = fmt::format("time per unknown of {} touches, an estimate after each",
                                     result.touches),
              .y_label = "mean pose error (mm)",
              .x_tick = seconds_text,
              .y_tick = mm_text};
  const std::vector<PosedError> posed = posed_errors(result);
  std::vector<CostAndError> entries;
  for (const PosedError& one : posed) {
    entries.push_back({one.point->seconds_unknown, one.error->mean_mm});
  }
  ChartSeries front{.name = "front", .colour = grey, .line = true, .marks = false};
  for (const std::size_t i : pareto_front(entries)) {
    front.points.push_back({.x = entries[i].cost, .y = entries[i].error, .label = {}, .title = {}});
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
  Shape shape;
};
constexpr Family families[] = {{"register tiles", "register tiles", Shape::square},
                               {"runs", "rows", Shape::circle},
                               {"one-bin", "one-bin kernel", Shape::triangle},
                               {"CPU loop", "CPU loop", Shape::diamond},
                               {"particles", "particles", Shape::triangle}};

Chart precision_chart(const SweepResult& result) {
  Chart chart{.title = "Time against numerical error",
              .x_label = "time per pose, element and touch (ns)",
              .y_label = "largest deviation from float64 (nats per touch)",
              .x_tick = ns_text,
              .y_tick = nats_text};
  std::vector<CostAndError> entries;
  for (const Precision& precision : result.precisions) {
    entries.push_back({precision.nanoseconds, precision.deviation.largest});
  }
  ChartSeries front{.name = "front", .colour = grey, .line = true, .marks = false};
  for (const std::size_t i : pareto_front(entries)) {
    front.points.push_back({.x = entries[i].cost, .y = entries[i].error, .label = {}, .title = {}});
  }
  chart.series.push_back(std::move(front));
  for (int colour = 0; colour < static_cast<int>(std::size(families)); ++colour) {
    const Family& family = families[colour];
    ChartSeries series{
        .name = family.name,
        .colour = colour,
        .shape = family.shape,
        .fill = std::string_view(family.begin) == "particles" ? Fill::none : Fill::solid};
    for (const Precision& precision : result.precisions) {
      if (precision.path.starts_with(family.begin)) {
        series.points.push_back(
            {.x = precision.nanoseconds,
             .y = precision.deviation.largest,
             .label = count_text(static_cast<double>(precision.count)),
             .title = fmt::format("{}, {} poses: {:.3g} ns; largest {:.2e}, RMS {:.2e} nats per "
                                  "touch",
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
  Chart chart{.title = "Error against bins",
              .x_label = "bins per object",
              .y_label = "mean pose error (mm)",
              .x_tick = count_text,
              .y_tick = mm_text};
  ChartSeries nearest{
      .name = "nearest bin", .colour = grey, .line = true, .dashed = true, .marks = false};
  int colour = 0;
  for (const CellFinding& finding : result.findings) {
    ChartSeries mode{.name = fmt::format("{} mm cells, mode", finding.cell_mm),
                     .colour = colour,
                     .shape = Shape::circle,
                     .line = true};
    ChartSeries refined{.name = fmt::format("{} mm, refined", finding.cell_mm),
                        .colour = colour,
                        .shape = Shape::square,
                        .fill = Fill::none,
                        .line = true};
    const std::vector<SweepPoint> runs = histograms_of(result, finding.cell_mm);
    for (const SweepPoint& run : runs) {
      const auto x = static_cast<double>(run.count);
      if (run.last.error) {
        mode.points.push_back({.x = x,
                               .y = run.last.error->mean_mm,
                               .label = {},
                               .title = title_of({&run, false, &*run.last.error})});
      }
      if (run.last.refined_error) {
        refined.points.push_back({.x = x,
                                  .y = run.last.refined_error->mean_mm,
                                  .label = {},
                                  .title = title_of({&run, true, &*run.last.refined_error})});
      }
      if (finding.cell_mm == 0.5) {
        nearest.points.push_back({.x = x, .y = *run.nearest_bin_mm, .label = {}, .title = {}});
      }
    }
    const auto balanced = static_cast<double>(finding.balanced_count);
    if (balanced <= 2.0 * static_cast<double>(runs.back().count)) {
      chart.rules.push_back({.vertical = true,
                             .at = balanced,
                             .colour = colour,
                             .label = fmt::format("auto, {} mm", finding.cell_mm)});
    }
    chart.series.push_back(std::move(mode));
    chart.series.push_back(std::move(refined));
    ++colour;
  }
  const auto least = std::min_element(
      result.findings.begin(), result.findings.end(),
      [](const CellFinding& a, const CellFinding& b) { return a.floor_mm < b.floor_mm; });
  if (least->floor_mm > 0.0) {
    chart.rules.push_back({.vertical = false,
                           .at = least->floor_mm,
                           .colour = grey,
                           .label = fmt::format("noise floor {:.3f} mm", least->floor_mm)});
  }
  chart.series.push_back(std::move(nearest));
  return chart;
}

}  // namespace

std::vector<NamedChart> charts_of(const SweepResult& result) {
  const auto named = [](const char* name, const Chart& chart, std::string caption) {
    return NamedChart{.name = name,
                      .title = chart.title,
                      .svg = svg_of(chart),
                      .file = svg_file(chart),
                      .caption = std::move(caption)};
  };
  return {
      named("front", pose_chart(result),
            "Labels are bins per object, of which there are five, or particles in all. Solid "
            "marks: maps of 0.5 mm cells; half filled: 0.25 mm; hollow: 1 mm. Errors are over the "
            "trials whose mode has the right object, so points that identify badly look better "
            "than they are: see the accuracy in the table. The refined pose takes one more "
            "reduction, once per unknown, which is not timed."),
      named("precision", precision_chart(result),
            "The likelihood alone, for the histogram and the two baselines, side by side; for "
            "particles with the motion, the resampling and the estimate. Deviations of the "
            "log-likelihood are the largest of a sample of bins; the particles' are those of the "
            "weights after one touch."),
      named("bins", knee_chart(result),
            "The histogram on lattices of balanced steps. \"Nearest bin\" is the error of the bins "
            "that hold the true poses: what the lattice "
            "alone costs. A mode does better where a neighbour fits better. The noise floor is "
            "what is left on the finest lattice. "
            "Vertical lines: what --bins auto takes for these cells. Runs of many bins have fewer "
            "trials, the sentences below compare equal ones."),
  };
}

}  // namespace palpate::bench
