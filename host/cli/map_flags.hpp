#pragma once

#include <optional>
#include <string>
#include <vector>

#include "learning/map_task.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

/// The flags of `palpate map`.
struct MapFlags : MapRequest {
  const CLI::App* command = nullptr;    ///< whose flags these are
  std::vector<std::string> recordings;  ///< or drawings
  std::optional<double> mm_per_pixel;
  std::string occupied;
  std::optional<double> felt_share;
  std::string array;
  std::string png;
  std::string ros;

  /// Whether drawings are mapped.
  bool of_drawings() const;
};

void add_drawing_flags(CLI::App& command, MapFlags& flags);
/// Throws Error where flags of drawings alone are given without drawings.
void require_no_drawing_flags(const MapFlags& flags);
/// Maps of objects from drawings; `palpate map PART.png`.
void build_drawn_maps(const MapFlags& flags);

/// Throws Error where an output cannot be written or would overwrite an input.
/// @param names of the maps that may be written
/// @param with_sensor whether the folder's sensor model may be
void prepare_outputs(const MapFlags& flags, const std::vector<std::string>& names,
                     bool with_sensor = false);
/// Writes maps, with --ros and --png as these say, and prints what is said of them.
void write_maps(const MapFlags& flags, const LearnedMaps& learned);

}  // namespace palpate::cli
