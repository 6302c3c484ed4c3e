#pragma once

#include <span>

#include "figures/palette.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Colours of evidence in nats, a cell's log odds minus its map's prior, shared by maps drawn
/// together. White is 0, the darkest blue -range_nats or less, the darkest red range_nats or more.
struct EvidenceScale {
  double range_nats = 1.0;

  Colour colour(double evidence_nats) const { return diverging(evidence_nats / range_nats); }
};

/// Returns the scale whose range, rounded up, holds nine of ten cells that have evidence.
EvidenceScale evidence_scale(std::span<const OccupancyGrid> maps);

}  // namespace palpate
