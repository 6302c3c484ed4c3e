#include "own_data.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "io/input_file.hpp"
#include "letters.hpp"
#include "palpate/balanced_lattice.hpp"
#include "recognition/batch/input_reading.hpp"
#include "recognition/option_text.hpp"
#include "recognition/recordings.hpp"
#include "recognition/resolve.hpp"
#include "recognition/unknowns.hpp"

namespace palpate::bench {

namespace {

Request request_of(const OwnDataOptions& options) {
  Request request;
  request.maps = options.maps;
  request.scene = options.scene;
  request.bins = BinWidth::fine;
  const auto range = [](const char* flag, const std::string& text) {
    return text.empty() ? std::nullopt : std::optional(parse_range(flag, text));
  };
  request.x_mm = range("--x-mm", options.x_mm);
  request.y_mm = range("--y-mm", options.y_mm);
  request.theta_deg = range("--theta-deg", options.theta_deg);
  if (options.pivot_mm == "auto") {
    request.pivot_mm = Automatic{};
  } else if (!options.pivot_mm.empty()) {
    request.pivot_mm = parse_point("--pivot-mm", options.pivot_mm);
  }
  request.sensor_model = options.sensor_model;
  request.threshold = options.threshold;
  request.ratio = options.ratio;
  request.filter = FilterKind::automatic;
  return complete(std::move(request));
}

}  // namespace

OwnData read_own_data(const OwnDataOptions& options) {
  if (options.recordings.empty()) {
    refuse("--recordings", "missing; give recordings of unknowns, or a folder of them");
  }
  const Request request = request_of(options);
  std::vector<std::shared_ptr<const Recording>> recordings;
  std::vector<Unknown> unknowns;
  BatchInference like;
  double reach_mm = 0.0;
  RecordingReader reader;
  for (const BatchInput& input : list_inputs(options.recordings)) {
    ReadInput read = read_input(reader, input, request, recordings.empty() ? nullptr : &like);
    like.pressure_unit = read.recording->pressure_unit;
    like.unit_from = recordings.empty() ? input.path : like.unit_from;
    reach_mm = std::max(reach_mm, largest_reach_mm(std::span(read.recording.get(), 1)));
    std::ranges::move(read.unknowns, std::back_inserter(unknowns));
    recordings.push_back(std::move(read.recording));
  }
  RecognitionTask task =
      resolve(request, {.pressure_unit = like.pressure_unit,
                        .source = like.unit_from,
                        .reach_mm = reach_mm,
                        .counts = std::array{1, 1, 1}});  // the counts are chosen below
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
