#pragma once

#include <span>

#include <glm/vec2.hpp>

#include "palette.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Corners of the area that the map's cells cover, in mm.
glm::dvec2 lower_edge_mm(const OccupancyGrid& map);
glm::dvec2 upper_edge_mm(const OccupancyGrid& map);

/// What colours stand for in maps drawn together: the evidence in nats, that is a cell's log odds
/// minus its map's prior. White is none, the darkest blue -range or less, the darkest red range or
/// more.
struct EvidenceScale {
  double range_nats = 1.0;

  Colour colour(double evidence_nats) const { return diverging(evidence_nats / range_nats); }
};

/// The scale that nine of ten cells with any evidence stay within, its range rounded up.
EvidenceScale evidence_scale(std::span<const OccupancyGrid> maps);

}  // namespace palpate
