#include <algorithm>
#include <array>
#include <iterator>

#include <fmt/format.h>

#include "bounded_parts.hpp"
#include "command_run.hpp"
#include "letters.hpp"
#include "palpate/error.hpp"
#include "refined_blocks_picture.hpp"

namespace palpate::bench {

namespace {

constexpr const char* streaming = bounded_parts[2];
constexpr const char* growth = bounded_parts[4];
constexpr const char* presses = bounded_parts[6];

constexpr const char* picture_name = "bounded_search.png";

/// Bins all over the letters.
PoseLattice picture_lattice(bool quick) {
  constexpr double extent_mm = 15.0;
  PoseLattice lattice = quick ? lattice_of(20, 20, 16) : lattice_of(200, 200, 250);
  lattice.x_mm = {-extent_mm, extent_mm, lattice.x_mm.count};
  lattice.y_mm = lattice.x_mm;
  return lattice;
}

/// The files that the parts leave in the folder of charts.
std::vector<std::string> figure_files_of(const std::vector<std::string>& parts) {
  std::vector<std::string> files;
  if (std::ranges::count(parts, growth) > 0) {
    files = chart_files(std::array{growth_figure});
  }
  if (std::ranges::count(parts, streaming) > 0) {
    files.emplace_back(picture_name);
  }
  return files;
}

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
  std::vector<Output> outputs = {{"--json", options.json}};
  if (const std::vector<std::string> figures = figure_files_of(parts); !figures.empty()) {
    outputs.push_back({"--plots", options.plots, figures});
  }
  CommandRun run(options, outputs, command_line);
  const std::vector<Hypothesis> letters =
      letter_maps(run.device(), training_recordings(), MapOptions{});
  const BoundedInputs inputs{run.device(), letters, options};
  Report report(run.facts());
  Json records = Json::object();
  for (const std::string& part : parts) {
    records[part] = measure(part, inputs, report);
    if (part == growth && !options.plots.empty()) {
      draw_growth(records[part], options.plots);
    }
    if (part == streaming && !options.plots.empty()) {
      write_file(std::filesystem::path(options.plots) / picture_name,
                 draw_refined_blocks(letters, picture_lattice(options.quick)));
    }
  }
  Json document = report.document();
  document.update(records);
  run.write(options.json, document.dump(2) + "\n");
}

}  // namespace palpate::bench
