#pragma once

#include <span>

#include <nlohmann/json.hpp>

#include "figures/placed_belief.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

// What the page draws, as JSON. Pictures are a number from 0 to 255 for each cell, row by row, the
// lowest row first: up to 4 bytes of text for a cell, three times as much as base64 takes, and
// 16 bytes of memory while the text is written.

namespace palpate::cli {

/// [x, y, theta] in mm and rad.
nlohmann::ordered_json pose_json(const Pose& pose);
/// [[x, y], ...] in mm.
nlohmann::ordered_json places_json(std::span<const glm::dvec2> places_mm);
/// Four digits of each; null where nothing is known.
nlohmann::ordered_json pressure_json(std::span<const double> pressure);
/// label, lower_mm (the outer corner of the first cell, in the object frame), cell_mm, nx, ny, nats
/// (the evidence of the strongest colour), and evidence: 128 + 127 x log odds above the prior over
/// nats.
nlohmann::ordered_json map_json(const OccupancyGrid& map);
/// lower_mm, cell_mm, cells, peak (the likeliest cell's probability), xy: 255 for the peak, less by
/// 42.5 for each power of ten below it; theta [[rad, probability], ...].
nlohmann::ordered_json belief_json(const PlacedBelief& belief);

}  // namespace palpate::cli
