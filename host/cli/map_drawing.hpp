#pragma once

#include "cli/map_flags.hpp"

namespace palpate::cli {

void add_drawing_flags(CLI::App& command, MapFlags& flags);
/// Throws Error where flags of drawings alone are given without drawings.
void require_no_drawing_flags(const MapFlags& flags);

/// Maps of objects from drawings; `palpate map PART.png`.
void build_drawn_maps(const MapFlags& flags);

}  // namespace palpate::cli
