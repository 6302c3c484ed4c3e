#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bin_likelihood.hpp"
#include "known_elements.hpp"
#include "tile_bounds.hpp"

namespace palpate {

/// Bins of one object and theta, and how likely a touch is among them at most.
struct TouchTile {
  double bound = 0.0;       ///< of the log-likelihood of the touch at any of the bins, in nats
  double log_weight = 0.0;  ///< log of (prior weight * bins * exp(bound))
  BinBox box;
  std::int32_t x = 0;  ///< the tile's place in its level
  std::int32_t y = 0;
};

/// Cuts boxes of bins, at most one for each object and theta, into tiles that follow a touch's
/// likelihood: small where the bounds of larger ones say that much of it may lie. All bins of the
/// boxes that count are in one tile each.
/// @param counts whether any bin of a box may count; tiles without one are left out
/// @param boxes ascending by object and theta
/// @param log_weight log of the objects' prior weights
/// @param turns [theta] its cosine and sine
/// @returns the smallest tiles first; those of one size in the order of object, theta and batch
std::vector<TouchTile> touch_tiles(std::span<const BinBox> boxes,
                                   std::span<const TileBounds> bounds,
                                   std::span<const double> log_weight,
                                   std::span<const glm::dvec2> turns, const KnownElements& elements,
                                   const std::function<bool(const BinBox&)>& counts);

}  // namespace palpate
