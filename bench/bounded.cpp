#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

#include "bounded_parts.hpp"
#include "command_run.hpp"
#include "letters.hpp"
#include "palpate/error.hpp"

namespace palpate::bench {

namespace {

constexpr const char* growth = bounded_parts[4];
constexpr const char* presses = bounded_parts[6];

Json measure(const std::string& part, const BoundedInputs& inputs, Report& report) {
  constexpr decltype(&measure_bounded_speed) measures[] = {
      measure_bounded_speed,  measure_bounded_mode,   measure_bounded_streaming,
      measure_bounded_large,  measure_bounded_growth, measure_bounded_accuracy,
      measure_bounded_presses};
  static_assert(std::size(measures) == std::size(bounded_parts));
  const auto* const at = std::ranges::find(bounded_parts, part);
  return measures[at - std::begin(bounded_parts)](inputs, report);
}

std::vector<std::string> parts_of(const BoundedRunOptions& options) {
  if (options.part == presses && options.presses.empty()) {
    throw Error(Fault::input, "--part presses: give the folder of recordings by --presses FOLDER");
  }
  if (!options.part.empty()) {
    return {options.part};
  }
  std::vector<std::string> parts(std::begin(bounded_parts), std::end(bounded_parts));
  if (options.presses.empty()) {
    std::erase(parts, presses);
  }
  return parts;
}

}  // namespace

void measure_bounded(const BoundedRunOptions& options, std::span<char* const> command_line) {
  const std::vector<std::string> parts = parts_of(options);
  const bool draws = !options.plots.empty() && std::ranges::count(parts, growth) > 0;
  std::vector<Output> outputs = {{"--json", options.json}};
  if (draws) {
    outputs.push_back({"--plots", options.plots, chart_files(std::array{growth_figure})});
  }
  CommandRun run(options, outputs, command_line);
  const std::vector<Hypothesis> letters =
      letter_maps(run.device(), training_recordings(), MapOptions{});
  const BoundedInputs inputs{run.device(), letters, options};
  Report report(run.facts());
  Json records = Json::object();
  for (const std::string& part : parts) {
    records[part] = measure(part, inputs, report);
  }
  if (draws) {
    draw_growth(records[growth], options.plots);
  }
  Json document = report.document();
  document.update(records);
  run.write(options.json, document.dump(2) + "\n");
}

}  // namespace palpate::bench
