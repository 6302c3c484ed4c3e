#include <algorithm>
#include <iterator>

#include "bounded_parts.hpp"
#include "command_run.hpp"
#include "letters.hpp"
#include "refined_blocks_picture.hpp"

namespace palpate::bench {

namespace {

constexpr const char* streaming = bounded_parts[2];

constexpr const char* picture_name = "bounded_search.png";

/// Bins all over the letters.
PoseLattice picture_lattice(bool quick) {
  constexpr double extent_mm = 15.0;
  PoseLattice lattice = quick ? lattice_of(20, 20, 16) : lattice_of(200, 200, 250);
  lattice.x_mm = {-extent_mm, extent_mm, lattice.x_mm.count};
  lattice.y_mm = lattice.x_mm;
  return lattice;
}

Json measure(const std::string& part, const BoundedInputs& inputs, Report& report) {
  constexpr decltype(&measure_bounded_speed) measures[] = {
      measure_bounded_speed, measure_bounded_mode, measure_bounded_streaming, measure_bounded_large,
      measure_bounded_growth};
  static_assert(std::size(measures) == std::size(bounded_parts));
  const auto* const at = std::ranges::find(bounded_parts, part);
  return measures[at - std::begin(bounded_parts)](inputs, report);
}

}  // namespace

void measure_bounded(const BoundedRunOptions& options, std::span<char* const> command_line) {
  std::vector<std::string> parts(std::begin(bounded_parts), std::end(bounded_parts));
  if (!options.part.empty()) {
    parts = {options.part};
  }
  std::vector<Output> outputs = {{"--json", options.json}};
  if (std::ranges::count(parts, streaming) > 0) {
    outputs.push_back({"--plots", options.plots, {picture_name}});
  }
  CommandRun run(options, outputs, command_line);
  const std::vector<Hypothesis> letters =
      letter_maps(run.device(), training_recordings(), MapOptions{});
  const BoundedInputs inputs{run.device(), letters, options};
  Report report(run.facts());
  Json records = Json::object();
  for (const std::string& part : parts) {
    records[part] = measure(part, inputs, report);
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
