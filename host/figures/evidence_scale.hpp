#pragma once

#include <span>

#include <glm/vec2.hpp>

#include "figures/palette.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Returns a corner of the area that the map's cells cover, in mm in the object frame.
glm::dvec2 lower_edge_mm(const OccupancyGrid& map);
glm::dvec2 upper_edge_mm(const OccupancyGrid& map);

/// Colours of evidence in nats, a cell's log odds minus its map's prior, shared by maps drawn
/// together. White is 0, the darkest blue -range_nats or less, the darkest red range_nats or more.
struct EvidenceScale {
  double range_nats = 1.0;

  Colour colour(double evidence_nats) const { return diverging(evidence_nats / range_nats); }
};

/// Returns the scale whose range, rounded up, holds nine of ten cells that have evidence.
EvidenceScale evidence_scale(std::span<const OccupancyGrid> maps);

}  // namespace palpate
