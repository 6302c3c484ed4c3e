#include <algorithm>
#include <iterator>

#include "beliefs_parts.hpp"
#include "command_run.hpp"
#include "letters.hpp"
#include "misplaced_picture.hpp"
#include "palpate/error.hpp"

namespace palpate::bench {

namespace {

constexpr const char* picture_name = "misplaced_unknown.png";

Json measure(const std::string& part, const BeliefInputs& inputs, Report& report) {
  constexpr decltype(&measure_misplaced) measures[] = {
      measure_misplaced, measure_touch_sd, measure_none, measure_slip, measure_plan, measure_costs};
  static_assert(std::size(measures) == std::size(belief_parts));
  const auto* const at = std::ranges::find(belief_parts, part);
  return measures[at - std::begin(belief_parts)](inputs, report);
}

/// The files that the parts leave in the folder of charts.
std::vector<std::string> figure_files_of(const std::vector<std::string>& parts) {
  std::vector<std::string> files;
  for (const std::string& part : parts) {
    for (std::string& file : chart_files(belief_figures(part))) {
      files.push_back(std::move(file));
    }
  }
  if (std::ranges::count(parts, belief_parts[0]) > 0) {
    files.emplace_back(picture_name);
  }
  return files;
}

}  // namespace

void measure_beliefs(const BeliefsOptions& options, std::span<char* const> command_line) {
  require_at_least("--trials", options.trials, 1);
  std::vector<std::string> parts(std::begin(belief_parts), std::end(belief_parts));
  if (!options.part.empty()) {
    parts = {options.part};
  }
  std::vector<Output> outputs = {{"--json", options.json}};
  const std::vector<std::string> figures = figure_files_of(parts);
  if (!figures.empty()) {
    outputs.push_back({"--plots", options.plots, figures});
  }
  CommandRun run(options, outputs, command_line);
  const std::vector<Hypothesis> letters =
      letter_maps(run.device(), training_recordings(), MapOptions{});
  const BeliefInputs inputs{run.device(), letters, options};
  Report report(run.facts());
  Json records = Json::object();
  for (const std::string& part : parts) {
    records[part] = measure(part, inputs, report);
    if (!options.plots.empty()) {
      draw_belief_figures(part, records[part], options.plots);
    }
  }
  if (!options.plots.empty() && std::ranges::count(parts, belief_parts[0]) > 0) {
    write_file(std::filesystem::path(options.plots) / picture_name,
               draw_misplaced_unknown(run.device(), letters));
  }
  Json document = report.document();
  document.update(records);
  run.write(options.json, document.dump(2) + "\n");
}

}  // namespace palpate::bench
