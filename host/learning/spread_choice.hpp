#pragma once

#include <cstddef>
#include <span>

#include "palpate/map_builder.hpp"

namespace palpate {

/// The spread of maps that predicts touches best.
struct SpreadChoice {
  double spread_mm = 0.0;
  /// What a touch gains in the mean over the default, in nats; 0 where the default stays.
  double likelihood_gain = 0.0;  ///< in its log-likelihood (Eq. 7) on the map of the others
  double place_gain = 0.0;       ///< in the log probability of its own place there
};

/// Fewest touches that tell a spread.
inline constexpr std::size_t least_spread_touches = 20;

/// Chooses one spread for the maps of all objects by cross-validation: each touch in turn is left
/// out, and predicted by the map of the other touches of its object. Beginning with the default,
/// the spread grows or shrinks by the root of 2 for as long as left-out touches become both more
/// likely and better placed, each by three standard errors over the touches. Likelihood alone
/// prefers maps that are too wide: they leave no gaps between few touches, but blur the edges by
/// which objects are placed. Places alone prefer maps that are too narrow where touches repeat each
/// other's: the sensor's elements then show in them.
/// @param options with the default spread, and the prior
/// @throws Error on a touch that is not sound, and as cover() does
SpreadChoice choose_spread(std::span<const ObjectTouches> objects, const MapOptions& options);

}  // namespace palpate
