#include "own_data.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "cli/batch/input_reading.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/recordings.hpp"
#include "io/input_file.hpp"
#include "letters.hpp"
#include "palpate/balanced_lattice.hpp"

namespace palpate::bench {

namespace {

cli::RecognitionFlags flags_of(const OwnDataOptions& options) {
  cli::RecognitionFlags flags;
  flags.maps = options.maps;
  flags.scene = options.scene;
  flags.bins = "fine";
  flags.x_mm = options.x_mm;
  flags.y_mm = options.y_mm;
  flags.theta_deg = options.theta_deg;
  flags.pivot_mm = options.pivot_mm;
  flags.sensor_model = options.sensor_model;
  flags.threshold = options.threshold;
  flags.ratio = options.ratio;
  flags.filter.filter = "auto";
  return flags;
}

}  // namespace

OwnData read_own_data(const OwnDataOptions& options) {
  if (options.recordings.empty()) {
    refuse("--recordings", "missing; give recordings of unknowns, or a folder of them");
  }
  const cli::RecognitionFlags flags = flags_of(options);
  cli::InputRules rules;
  rules.scene = cli::scene_of(flags);
  rules.scene_file = flags.scene;
  std::vector<std::shared_ptr<const Recording>> recordings;
  std::vector<Unknown> unknowns;
  cli::BatchInference like;
  double reach_mm = 0.0;
  RecordingReader reader;
  for (const cli::BatchInput& input : cli::list_inputs(options.recordings)) {
    cli::ReadInput read =
        cli::read_input(reader, input, rules, recordings.empty() ? nullptr : &like);
    like.pressure_unit = read.recording->pressure_unit;
    like.unit_from = recordings.empty() ? input.path : like.unit_from;
    reach_mm = std::max(reach_mm, cli::reach_mm(std::span(read.recording.get(), 1)));
    std::ranges::move(read.unknowns, std::back_inserter(unknowns));
    recordings.push_back(std::move(read.recording));
  }
  RecognitionTask task =
      cli::task_of(flags, rules.scene, like.pressure_unit, like.unit_from, reach_mm);
  const auto balanced = [&](BinWidth width) {
    return balanced_lattice(task.lattice(), task.hypotheses, most_bounded_bins, width).lattice;
  };
  const PoseLattice automatic = balanced(BinWidth::automatic);
  task.lattice() = balanced(BinWidth::fine);
  task.bin_width.reset();
  return {std::move(task), automatic, std::move(recordings), std::move(unknowns)};
}

std::string flags_of(const PoseLattice& lattice, bool auto_pivot) {
  constexpr double degrees = 57.29577951308232;
  const auto range = [](const char* flag, const Axis& axis, double unit) {
    return fmt::format(" {}={:.6g}:{:.6g}", flag, unit * axis.lower, unit * axis.upper);
  };
  std::string text = fmt::format("--bins {}", size_of(lattice)) +
                     range("--x-mm", lattice.x_mm, 1.0) + range("--y-mm", lattice.y_mm, 1.0);
  if (!lattice.full_circle()) {
    text += range("--theta-deg", lattice.theta_rad, degrees);
  }
  if (auto_pivot) {
    text += " --pivot-mm auto";
  } else if (lattice.pivot_mm != glm::dvec2(0.0, 0.0)) {
    text += fmt::format(" --pivot-mm={:.6g},{:.6g}", lattice.pivot_mm.x, lattice.pivot_mm.y);
  }
  return text;
}

}  // namespace palpate::bench
