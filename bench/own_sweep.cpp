// `palpate-bench sweep --maps ... --recordings ...`: how many bins a user's own objects need, and
// what bins cost on this device.

#include "own_sweep.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "command_run.hpp"
#include "filter_run.hpp"
#include "letters.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/error.hpp"
#include "palpate/pose_error.hpp"
#include "sweep_document.hpp"

namespace palpate::bench {

namespace {

/// Bins of the coarsest lattice; of a small region, a thirtieth of the finest one's.
constexpr double fewest_bins = 1e3;

/// Lattices of the region in the proportions of `fine`, by rising count, up to three times as many
/// bins: each has about three times as many as the one before.
std::vector<PoseLattice> lattices_of(const PoseLattice& fine, std::int64_t most) {
  const auto all = static_cast<double>(fine.bins());
  const double finest = std::min(3.0 * all, static_cast<double>(most));
  const std::array counts{fine.x_mm.count, fine.y_mm.count, fine.theta_rad.count};
  const auto free = std::ranges::count_if(counts, [](int count) { return count > 1; });
  const double power = 1.0 / static_cast<double>(std::max<std::ptrdiff_t>(1, free));
  std::vector<PoseLattice> lattices;
  constexpr double about = 0.9;  // counts of bins are near to what is asked for
  const double coarsest = std::min(fewest_bins, finest / 30.0);
  for (double count = finest; count >= about * coarsest; count /= std::sqrt(10.0)) {
    const double factor = std::pow(count / all, power);
    PoseLattice lattice = fine;
    for (Axis* axis : {&lattice.x_mm, &lattice.y_mm, &lattice.theta_rad}) {
      axis->count = std::max(1, static_cast<int>(std::lround(factor * axis->count)));
    }
    if (lattices.empty() || lattice.bins() < lattices.back().bins()) {
      lattices.push_back(lattice);
    }
  }
  std::ranges::reverse(lattices);
  return lattices;
}

/// The unknowns by a filter, and its costs. The first unknown is recognised once more before, which
/// does not count: it warms up.
FilterRun run_warm(Device& device, const RecognitionTask& task, std::span<const Unknown> unknowns) {
  std::vector<Unknown> twice{unknowns.front()};
  twice.insert(twice.end(), unknowns.begin(), unknowns.end());
  FilterRun run = run_filter(device, task, twice, false);
  run.records.erase(run.records.begin());
  return run;
}

Json seconds_of(const FilterRun& run) {
  std::vector<double> seconds;
  for (const RecognitionRecord& record : run.records) {
    seconds.push_back(record.seconds);
  }
  return median(seconds);
}

/// Medians of the refined poses' standard deviations over the unknowns: along x and y together in
/// mm, of theta in degrees.
void set_sd(Json& record, std::span<const RecognitionStep> steps) {
  std::vector<double> place_mm;
  std::vector<double> theta_deg;
  for (const RecognitionStep& step : steps) {
    if (const auto sd = step.sd()) {
      place_mm.push_back(std::hypot((*sd)[0], (*sd)[1]));
      theta_deg.push_back((*sd)[2] * 180.0 / std::numbers::pi);
    }
  }
  record["sd_mm"] = place_mm.empty() ? Json() : Json(median(place_mm));
  record["sd_deg"] = theta_deg.empty() ? Json() : Json(median(theta_deg));
}

/// Accuracy over the unknowns whose label is known.
void set_accuracy(Json& record, std::span<const RecognitionStep> steps) {
  int known = 0;
  int right = 0;
  for (const RecognitionStep& step : steps) {
    known += step.right ? 1 : 0;
    right += step.right.value_or(false) ? 1 : 0;
  }
  record["labelled"] = known;
  record["accuracy"] = known > 0 ? Json(right / static_cast<double>(known)) : Json();
}

/// Recognises all unknowns by bounds, and some by the histogram; all by the histogram where bounds
/// do not allow for what the task asks.
OwnRun measure(Device& device, const OwnData& data, const PoseLattice& lattice, std::size_t dense) {
  RecognitionTask task = data.task;
  task.lattice() = lattice;
  const std::optional<BoundedOptions> bounded =
      bounded_instead(std::get<HistogramOptions>(task.filter));
  OwnRun run{.lattice = lattice, .steps = {}, .errors = {}, .from_finest = {}, .record = {}};
  run.record = {{"count", lattice.bins()},
                {"bins", {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count}},
                {"bins_in_all", task.bins_in_all()},
                {"step_mm", std::max(lattice.x_mm.step(), lattice.y_mm.step())},
                {"recordings", data.unknowns.size()},
                {"histogram_recordings", 0},
                {"seconds_histogram", nullptr},
                {"seconds_bounds", nullptr},
                {"device_bytes", nullptr},
                {"host_bytes", nullptr}};
  std::vector<RecognitionRecord> records;
  // Half of the device's memory, as --bins auto has it.
  if (task.bins_in_all() <= most_bins_on(device, false) || !bounded) {
    const std::size_t count =
        bounded ? std::min(dense, data.unknowns.size()) : data.unknowns.size();
    FilterRun histogram = run_warm(device, task, std::span(data.unknowns).first(count));
    run.record["histogram_recordings"] = count;
    run.record["seconds_histogram"] = seconds_of(histogram);
    run.record["device_bytes"] = histogram.device_bytes;
    records = std::move(histogram.records);
  }
  if (bounded) {
    task.filter = *bounded;
    settle_evidence(task);
    FilterRun bounds = run_warm(device, task, data.unknowns);
    run.record["seconds_bounds"] = seconds_of(bounds);
    run.record["host_bytes"] = bounds.host_bytes;
    records = std::move(bounds.records);
  }
  for (RecognitionRecord& record : records) {
    run.steps.push_back(std::move(record.trace.back()));
    run.errors.add(run.steps.back());
  }
  set_accuracy(run.record, run.steps);
  set_errors(run.record, run.errors);
  set_sd(run.record, run.steps);
  return run;
}

/// Says how far the poses lie from those of the finest run.
void compare_with(const OwnRun& finest, std::span<const Hypothesis> hypotheses, OwnRun& run) {
  int same = 0;
  for (std::size_t i = 0; i < run.steps.size(); ++i) {
    const RecognitionStep& step = run.steps[i];
    const RecognitionStep& other = finest.steps[i];
    same += step.best == other.best ? 1 : 0;
    std::optional<double>& mode_mm = run.from_finest.mode_mm.emplace_back();
    std::optional<double>& refined_mm = run.from_finest.refined_mm.emplace_back();
    if (step.mode.object != other.mode.object) {
      continue;
    }
    const OccupancyGrid& map = hypotheses[static_cast<std::size_t>(step.mode.object)].map;
    const Body body = body_of(map);
    mode_mm =
        pose_error_mm(body, map.symmetry, step.mode.T_object_robot, other.mode.T_object_robot);
    if (step.refined && other.refined) {
      refined_mm = pose_error_mm(body, map.symmetry, step.refined->T_object_robot,
                                 other.refined->T_object_robot);
    }
  }
  run.record["same_object"] = same / static_cast<double>(run.steps.size());
  run.record["from_finest_mm"] = record_of(errors_over(run.from_finest.mode_mm));
  run.record["refined_from_finest_mm"] = record_of(errors_over(run.from_finest.refined_mm));
}

int true_poses(const OwnData& data) {
  return static_cast<int>(std::ranges::count_if(data.unknowns, [](const Unknown& unknown) {
    return unknown.truth.T_object_robot.has_value();
  }));
}

Json document_of(Device& device, const OwnData& data, const SweepOptions& options) {
  constexpr std::int64_t usual_most = 10'000'000;
  constexpr std::int64_t quick_most = 100'000;
  const std::int64_t most = options.max_bins.value_or(options.quick ? quick_most : usual_most);
  const std::vector<PoseLattice> lattices = lattices_of(data.task.lattice(), most);
  const std::size_t dense = options.quick ? 1 : 3;
  const bool truth_known = true_poses(data) > 0;
  const std::vector<Column> columns = own_columns(truth_known);
  OwnRun finest = measure(device, data, lattices.back(), dense);
  print_head(columns);
  std::vector<OwnRun> runs;
  Json points = Json::array();
  for (std::size_t i = 0; i < lattices.size(); ++i) {
    const bool last = i + 1 == lattices.size();
    OwnRun run = last ? std::move(finest) : measure(device, data, lattices[i], dense);
    compare_with(last ? OwnRun(run) : finest, data.task.hypotheses, run);
    print_row(columns, run.record);
    points.push_back(run.record);
    runs.push_back(std::move(run));
  }
  const OwnAdvice advice = advice_of(runs, data);
  const auto count_at = [&](const std::optional<std::size_t>& i) {
    return i ? points[*i].at("count") : Json();
  };
  return {{"maps", data.task.hypotheses.size()},
          {"recordings", data.unknowns.size()},
          {"true_poses", true_poses(data)},
          {"points", points},
          {"auto_count", data.automatic.bins()},
          {"fine_count", data.task.lattice().bins()},
          {"mode_count", count_at(advice.mode)},
          {"refined_count", count_at(advice.refined)},
          {"advice", advice.sentence}};
}

}  // namespace

std::vector<Column> own_columns(bool truth_known) {
  const Text mib = number_text("{:.1f}", 1.0 / (1 << 20));
  const Text millimetres = number_text("{:.3f}");
  std::vector<Column> columns{
      {"bins per object", "/count", count_text},
      {"bins", "/bins"},
      {"step, mm", "/step_mm", number_text("{:.2f}")},
      {"recognised, %", "/accuracy", number_text("{:.0f}", 100.0)},
      {"object of the finest, %", "/same_object", number_text("{:.0f}", 100.0)}};
  if (truth_known) {
    columns.push_back({"mode: mean error, mm", "/error_mm", mean_text});
    columns.push_back({"refined: mean error, mm", "/refined_error_mm", mean_text});
  } else {
    columns.push_back({"mode: from the finest, mm", "/from_finest_mm/mean", millimetres});
    columns.push_back(
        {"refined: from the finest, mm", "/refined_from_finest_mm/mean", millimetres});
  }
  columns.insert(columns.end(), {{"sd of the place, mm", "/sd_mm", millimetres},
                                 {"of theta, deg", "/sd_deg", number_text("{:.2f}")},
                                 {"per unknown, histogram", "/seconds_histogram", seconds_text},
                                 {"by bounds", "/seconds_bounds", seconds_text},
                                 {"device memory, MiB", "/device_bytes", mib},
                                 {"bounds' memory, MiB", "/host_bytes", mib}});
  return columns;
}

void run_own_sweep(const SweepOptions& options, std::span<char* const> command_line) {
  for (const auto& [flag, given] : {std::pair("--html", !options.html.empty()),
                                    std::pair("--trials", options.trials.has_value())}) {
    if (given) {
      throw Error(Fault::input, fmt::format("{}: is for the letters' sweep; leave it out beside "
                                            "--maps and --recordings",
                                            flag));
    }
  }
  const OwnData data = read_own_data(options.own);
  CommandRun run(
      options, {{"--json", options.json}, {"--plots", options.plots, chart_files(own_chart_names)}},
      command_line,
      fmt::format("{} recordings, {} maps", data.unknowns.size(), data.task.hypotheses.size()));
  Json document = run.facts();
  document.update(document_of(run.device(), data, options));
  fmt::print("\n{}\n", plain_text(document.at("advice")));
  run.write(options.json, document.dump(2) + "\n");
  if (!options.plots.empty()) {
    write_charts(own_charts_of(document), options.plots, own_chart_names);
  }
}

}  // namespace palpate::bench
