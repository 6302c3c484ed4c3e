#pragma once

#include "figures/axes.hpp"
#include "figures/evidence_scale.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale);

/// Draws the map in a view of another frame; white beyond it.
void draw_cells(Canvas& canvas, const View& view, const OccupancyGrid& map,
                const EvidenceScale& scale, const Pose& T_map_view);

/// Draws the scale's colour bar, with words for its ends above. It takes 26 pixels above the box
/// and 56 below it.
void draw_evidence_bar(Canvas& canvas, const Box& box, const EvidenceScale& scale);

}  // namespace palpate
