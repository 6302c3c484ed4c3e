#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>

#include <fmt/format.h>

#include "atomic_file.hpp"
#include "comparison.hpp"
#include "experiment_result.hpp"
#include "gnuplot.hpp"
#include "published.hpp"

namespace palpate::bench {

namespace {

/// Told apart by dashes and marks as well as by Okabe and Ito's colours. Line types 11 and up are
/// what the paper reports.
constexpr const char* style = R"(
set encoding utf8
set border 3 lw 1.2
set tics nomirror out
set grid ytics lc rgb '#dddddd' lt 1
set key above horizontal samplen 4 spacing 1.2 width 2 reverse Left
set linetype 1 lc rgb '#0072b2' dt 1 lw 2 pt 7 ps 0.8
set linetype 2 lc rgb '#d55e00' dt 2 lw 2 pt 5 ps 0.8
set linetype 3 lc rgb '#009e73' dt 4 lw 2 pt 9 ps 0.9
set linetype 4 lc rgb '#cc79a7' dt 5 lw 2 pt 13 ps 1
set linetype 5 lc rgb '#000000' dt (12,4,2,4) lw 2 pt 4 ps 0.9
set linetype 11 lc rgb '#555555' dt 3 lw 2 pt 3 ps 2
set linetype 12 lc rgb '#555555' dt 3 lw 2 pt 1 ps 2
set datafile missing '?'
)";

struct Terminal {
  const char* extension;
  const char* command;
};
constexpr std::array terminals = {
    Terminal{"png", "set terminal pngcairo size 960,600 font 'DejaVu Sans,12'"},
    Terminal{"svg", "set terminal svg size 960,600 font 'DejaVu Sans,15' background 'white'"}};

/// Lines that share axes, in gnuplot's words.
class Chart {
 public:
  /// Settings such as title and axes.
  explicit Chart(std::string settings) : settings_(std::move(settings)) {}

  /// Adds points; what is not a number leaves a gap. `form` says how they are drawn.
  void add(const std::vector<std::array<double, 2>>& points, const std::string& title,
           const std::string& form) {
    const std::string name = fmt::format("$data{}", count_++);
    data_ += name + " << END\n";
    for (const auto& [x, y] : points) {
      data_ += fmt::format("{:.6g} {}\n", x, std::isfinite(y) ? fmt::format("{:.6g}", y) : "?");
    }
    data_ += "END\n";
    plot(fmt::format("{} using 1:2", name), title, form);
  }
  /// Adds the area between two values at every x.
  void fill(const std::vector<std::array<double, 3>>& bands, const std::string& form) {
    const std::string name = fmt::format("$data{}", count_++);
    data_ += name + " << END\n";
    for (const auto& [x, low, high] : bands) {
      data_ += fmt::format("{:.6g} {:.6g} {:.6g}\n", x, low, high);
    }
    data_ += "END\n";
    plot(fmt::format("{} using 1:2:3", name), "", "filledcurves " + form);
  }
  /// Adds a function of x.
  void plot(const std::string& what, const std::string& title, const std::string& form) {
    plots_ += fmt::format("{}{} with {} title {}", plots_.empty() ? "plot " : ", ", what, form,
                          gnuplot_quoted(title));
  }

  void draw(const std::filesystem::path& folder, const std::string& name) const {
    for (const Terminal& terminal : terminals) {
      AtomicFile file(folder / fmt::format("{}.{}", name, terminal.extension));
      run_gnuplot(fmt::format("{}\nset output {}\n{}{}\n{}{}\nset output\n", terminal.command,
                              gnuplot_quoted(file.path()), style, settings_, data_, plots_));
      file.commit();
    }
  }

 private:
  std::string settings_;
  std::string data_;
  std::string plots_;
  int count_ = 0;
};

using Value = std::function<double(const CurvePoint&)>;

double accuracy_percent(const CurvePoint& point) { return 100.0 * point.accuracy; }
double mean_error_mm(const CurvePoint& point) { return point.error ? point.error->mean_mm : NAN; }

/// `form` is a line type, and what differs from it.
void add_curve(Chart& chart, const FilterRun& run, const Value& value, const std::string& title,
               const std::string& form) {
  std::vector<std::array<double, 2>> points;
  for (const CurvePoint& point : curve_of(run)) {
    points.push_back({static_cast<double>(point.touches), value(point)});
  }
  // Marks at every fifth touch, so that the dashes show between them.
  chart.add(points, title, "linespoints pi 5 lt " + form);
}

/// The 95 % intervals of every run of a filter's accuracy, to be drawn below the lines.
void add_intervals(Chart& chart, const ExperimentResult& result, const std::string& filter) {
  int linetype = 0;
  for (const FilterRun& run : result.runs) {
    if (run.filter == filter) {
      std::vector<std::array<double, 3>> band;
      for (const CurvePoint& point : curve_of(run)) {
        band.push_back({static_cast<double>(point.touches), 100.0 * point.accuracy_interval.low,
                        100.0 * point.accuracy_interval.high});
      }
      chart.fill(band, fmt::format("lt {} fs transparent solid 0.12 noborder", ++linetype));
    }
  }
}

/// One line for every run of a filter.
void add_runs(Chart& chart, const ExperimentResult& result, const std::string& filter,
              const Value& value, const std::string& form = "") {
  int linetype = 0;
  for (const FilterRun& run : result.runs) {
    if (run.filter == filter) {
      add_curve(chart, run, value, run.name, fmt::format("{} {}", ++linetype, form));
    }
  }
}

Chart chart_over_touches(const std::string& settings) {
  return Chart("set xlabel 'touches'\nset xrange [0:*]\n" + settings);
}

/// Every run of a filter over the number of touches.
Chart chart_of(const ExperimentResult& result, const std::string& filter, const Value& value,
               const std::string& settings, const std::string& form = "") {
  Chart chart = chart_over_touches(settings);
  add_runs(chart, result, filter, value, form);
  return chart;
}

constexpr const char* accuracy_axis =
    "set ylabel 'trials with the right letter (%)'\nset yrange [0:105]\n";
/// The 95 % interval as a light band behind every curve.
Chart accuracy_chart_of(const ExperimentResult& result, const std::string& filter) {
  Chart chart = chart_over_touches(
      "set ylabel 'trials with the right letter, and 95 % interval (%)'\nset yrange [0:105]\n");
  add_intervals(chart, result, filter);
  add_runs(chart, result, filter, accuracy_percent);
  return chart;
}

constexpr const char* error_axis =
    "set ylabel 'mean pose error where the letter is right (mm)'\nset yrange [0:*]\n";

void draw_paper_figures(const ExperimentResult& result, const std::filesystem::path& folder) {
  Chart fig6a = accuracy_chart_of(result, "particles");
  fig6a.plot(fmt::format("{}", 100.0 * published::particle_accuracy),
             "paper: 10,000 particles level out", "lines lt 11");
  fig6a.draw(folder, "fig6a");
  chart_of(result, "particles", mean_error_mm, error_axis).draw(folder, "fig6b");

  Chart fig7a = accuracy_chart_of(result, "histogram");
  fig7a.add({{published::bins_1000_know_after, 100.0}}, "paper: 1,000 bins reach 100 %",
            "points lt 12");
  fig7a.add({{published::bins_10000_know_after, 100.0}}, "paper: 10,000 bins reach 100 %",
            "points lt 11");
  fig7a.draw(folder, "fig7a");
  Chart fig7b = chart_of(result, "histogram", mean_error_mm, error_axis);
  fig7b.plot(fmt::format("{}", published::error_mm), "paper: 1.3 mm", "lines lt 11");
  fig7b.draw(folder, "fig7b");
}

/// The largest size of a filter.
std::int64_t most_of(const ExperimentResult& result, const std::string& filter) {
  std::int64_t most = 0;
  for (const FilterRun& run : result.runs) {
    most = run.filter == filter ? std::max(most, run.count) : most;
  }
  return most;
}

/// Mean, median, 95th percentile and refined error of the finest histogram.
void draw_errors(const ExperimentResult& result, const std::filesystem::path& folder) {
  const auto finest =
      std::find_if(result.runs.begin(), result.runs.end(), [&](const FilterRun& run) {
        return run.filter == "histogram" && run.count == most_of(result, "histogram");
      });
  Chart chart =
      chart_over_touches(fmt::format("set logscale y\nset yrange [0.3:30]\n"
                                     "set ytics (0.5, 1, 2, 5, 10, 20)\n"
                                     "set ylabel 'pose error where the letter is right (mm)'\n"
                                     "set title {}\n",
                                     gnuplot_quoted(finest->name)));
  const auto with = [](double ErrorSummary::*field, std::optional<ErrorSummary> CurvePoint::*of) {
    return [=](const CurvePoint& point) { return point.*of ? *(point.*of).*field : NAN; };
  };
  using E = ErrorSummary;
  using P = CurvePoint;
  add_curve(chart, *finest, with(&E::p95_mm, &P::error), "mode, 95th percentile", "2");
  add_curve(chart, *finest, with(&E::mean_mm, &P::error), "mode, mean", "1");
  add_curve(chart, *finest, with(&E::median_mm, &P::error), "mode, median", "3");
  add_curve(chart, *finest, with(&E::p95_mm, &P::refined_error), "refined, 95th percentile", "4");
  add_curve(chart, *finest, with(&E::mean_mm, &P::refined_error), "refined, mean", "5");
  chart.draw(folder, "errors");
}

/// The mode's error beside the refined pose's, of the histograms with the most bins.
void draw_refined(const ExperimentResult& result, const std::filesystem::path& folder) {
  Chart chart = chart_over_touches(
      "set logscale y\nset yrange [0.2:20]\nset ytics (0.2, 0.5, 1, 2, 5, 10, 20)\n"
      "set ylabel 'mean pose error where the letter is right (mm)'\n");
  const auto refined_mm = [](const CurvePoint& point) {
    return point.refined_error ? point.refined_error->mean_mm : NAN;
  };
  int linetype = 0;
  for (const FilterRun& run : result.runs) {
    if (run.filter == "histogram" && as_many(run.count, most_of(result, "histogram"))) {
      add_curve(chart, run, mean_error_mm, run.name + ", mode", fmt::format("{}", ++linetype));
      add_curve(chart, run, refined_mm, run.name + ", refined", fmt::format("{}", ++linetype));
    }
  }
  chart.draw(folder, "refined");
}

/// Pose errors with the array where it is reported and off by each noise, for the largest counts.
void draw_pose_noise(const ExperimentResult& result, const std::filesystem::path& folder) {
  const std::vector<FilterRun>& noisy = result.pose_noise.front().runs;
  Chart chart =
      chart_over_touches(fmt::format("set xrange [0:{}]\nset logscale y\nset yrange [0.3:20]\n"
                                     "set ytics (0.5, 1, 2, 5, 10, 20)\n"
                                     "set ylabel 'mean pose error where the letter is "
                                     "right (mm)'\n",
                                     noisy.front().scores.front().size()));
  int form = 0;  // dashes tell filters apart, colours the noise
  for (const FilterRun& filter : noisy) {
    if (filter.count != most_of(result, filter.filter)) {
      continue;
    }
    ++form;
    const auto add = [&](const std::vector<FilterRun>& runs, const std::string& name,
                         int linetype) {
      const auto run = std::find_if(runs.begin(), runs.end(), [&](const FilterRun& candidate) {
        return candidate.name == filter.name;
      });
      add_curve(chart, *run, mean_error_mm, fmt::format("{}, {}", filter.name, name),
                fmt::format("{} dt {} pt {}", linetype, form, form == 1 ? 7 : 4));
    };
    int linetype = 1;
    add(result.runs, "exact", linetype);
    for (const PoseNoiseRuns& runs : result.pose_noise) {
      add(runs.runs,
          fmt::format("{} mm, {} rad", runs.noise.translation_mm, runs.noise.rotation_rad),
          ++linetype);
    }
  }
  chart.draw(folder, "pose_noise");
}

void draw_calibration(const ExperimentResult& result, const std::filesystem::path& folder) {
  constexpr int fewest = 10;  // estimates of which a fraction says something
  Chart chart(
      fmt::format("set xlabel 'confidence: probability of the most probable letter (%)'\n"
                  "set ylabel 'estimates that are right (%)'\n"
                  "set xrange [0:100]\nset yrange [0:105]\nset grid xtics\n"
                  "set title 'at least {} estimates per point'\n",
                  fewest));
  chart.plot("x", "as sure as right", "lines lt 11");
  int linetype = 0;
  for (const FilterRun& run : result.runs) {
    const bool shown = run.filter == "histogram" ||
                       (run.filter == "particles" && run.count == most_of(result, "particles"));
    if (!shown) {
      continue;  // all nine would hide more than they show
    }
    const Calibration calibration = calibration_of(run);
    std::vector<std::array<double, 2>> points;
    for (const Calibration::Bin& bin : calibration.bins) {
      if (bin.count >= fewest) {
        points.push_back({100.0 * bin.mean_confidence, 100.0 * bin.fraction_right});
      }
    }
    chart.add(points, fmt::format("{}, {:.1f} % off", run.name, 100.0 * calibration.expected_error),
              fmt::format("linespoints lt {}", ++linetype));
  }
  chart.draw(folder, "calibration");
}

void draw_none(const ExperimentResult& result, const std::filesystem::path& folder) {
  Chart chart(
      "set xlabel 'prior weight of \"none of these\", each letter having 1'\n"
      "set format x '10^{%.0f}'\nset autoscale xfix\n"
      "set ylabel 'unknowns called \"none of these\" (%)'\n"
      "set yrange [0:105]\n");
  int linetype = 0;
  for (const NoneRun& run : result.none) {
    std::vector<std::array<double, 2>> noticed;
    std::vector<std::array<double, 2>> lost;
    for (const double log10_weight : sampled_log10_weights(result.none)) {
      noticed.push_back({log10_weight, 100.0 * run.noticed(log10_weight)});
      lost.push_back({log10_weight, 100.0 * run.lost(log10_weight)});
    }
    const std::string form = fmt::format("linespoints pi 10 lt {}", ++linetype);
    chart.add(noticed, fmt::format("never learned, {} touches", run.touches), form + " dt 1");
    chart.add(lost, fmt::format("learned, {} touches", run.touches), form + " dt 2");
  }
  chart.draw(folder, "none");
}

}  // namespace

std::vector<std::string> figure_files() {
  std::vector<std::string> files;
  for (const char* name : {"fig6a", "fig6b", "fig7a", "fig7b", "errors", "refined", "pose_noise",
                           "calibration", "none", "augmented"}) {
    for (const Terminal& terminal : terminals) {
      files.push_back(fmt::format("{}.{}", name, terminal.extension));
    }
  }
  return files;
}

void draw_figures(const ExperimentResult& result, const std::filesystem::path& folder) {
  draw_paper_figures(result, folder);
  Chart augmented = chart_of(result, "particles", accuracy_percent, accuracy_axis, "dt 1");
  add_runs(augmented, result, "augmented", accuracy_percent, "dt 2 lw 3");
  augmented.draw(folder, "augmented");
  draw_errors(result, folder);
  draw_refined(result, folder);
  draw_pose_noise(result, folder);
  draw_calibration(result, folder);
  draw_none(result, folder);
}

}  // namespace palpate::bench
