#pragma once

#include <cstddef>
#include <span>

#include "palpate/map_builder.hpp"

namespace palpate {

/// The spread of maps that predicts touches best.
struct SpreadChoice {
  double spread_mm = 0.0;
  /// By how much left-out touches are more likely (Eq. 7) than with the default, in nats per touch;
  /// 0 where the default stays.
  double likelihood_gain = 0.0;
  double place_gain_mm = 0.0;  ///< by how much nearer to their places they seem to be
};

/// Fewest touches that tell a spread.
inline constexpr std::size_t least_spread_touches = 20;

/// Chooses one spread for the maps of all objects by cross-validation: each touch in turn is left
/// out, with all others at its place, and predicted by the map of the object's other touches.
/// Beginning with the default, the spread shrinks or grows by the root of 2 for as long as left-out
/// touches become more likely and are found nearer to their places, each by three standard errors
/// over the touches, and nearer by a tenth. Likelihood alone prefers maps that are too wide, which
/// leave no gaps between few touches but blur the edges by which objects are placed; or too narrow,
/// which are less sure where touches are misplaced. Takes all host threads.
/// @param options with the default spread, and the prior
/// @throws Error on a touch that is not sound, and as cover() does
SpreadChoice choose_spread(std::span<const ObjectTouches> objects, const MapOptions& options);

}  // namespace palpate
