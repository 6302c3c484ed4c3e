#pragma once

#include <span>

#include "palpate/map_builder.hpp"

namespace palpate {

/// The spread of maps that predicts touches best.
struct SpreadChoice {
  double spread_mm = 0.0;
  /// By how much more likely a touch is on the map of the others than with the default, in nats per
  /// touch in the mean; 0 where the default stays.
  double gain_nats = 0.0;
  double tried_from_mm = 0.0;
  double tried_to_mm = 0.0;
};

/// Chooses one spread for the maps of all objects by cross-validation: the log-likelihood (Eq. 7) of
/// every touch on the map that the other touches of its object make. Beginning with the default,
/// spreads grow or shrink by the root of 2 while touches become more likely. The default stays
/// unless the best is better by three standard errors, over touches, and by a tenth of what a touch
/// is unlikely by: likelihoods differ more than pose errors do.
/// @param options with the default spread, and the prior
/// @throws Error on a touch that is not sound, and as cover() does
SpreadChoice choose_spread(std::span<const ObjectTouches> objects, const MapOptions& options);

}  // namespace palpate
