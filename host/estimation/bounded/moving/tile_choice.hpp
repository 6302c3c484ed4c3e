#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace palpate {

/// Belief in an object's tiles after a slip and a touch, all bins of a tile together, in nats.
struct TileBeliefs {
  std::vector<double> bound;  ///< [tile] upper bound
  /// [tile] upper bound of what comes of the bins that were followed; empty where it is not asked
  /// for. A bin has mass of such bins alone.
  std::vector<double> known = {};
  /// [tile] upper bound of what the tile's own bins held before the slip, which takes only a part
  /// of it away; empty with the above.
  std::vector<double> held = {};
  double scale = 0.0;  ///< to be added to all of them, in nats
  double least = 0.0;  ///< bound of a tile that is followed, without the scale
};

/// Which tiles a touch follows: [object][tile] 1.
using FollowedTiles = std::vector<std::vector<std::uint8_t>>;

/// All tiles whose bounds are at least the object's least.
FollowedTiles all_that_matter(std::span<const TileBeliefs> objects);

/// Leaves the best `most` of these tiles: those with known mass first, unless it is negligible,
/// then those of the largest bounds. Also leaves a few of each object that held mass before the
/// slip, so that no object loses all of it.
/// @param objects with what is known and held
/// @param followed tiles to choose from; receives those that are left
/// @param depth nats below the most known mass at which mass is negligible
/// @returns whether any was left out
bool leave_best(std::size_t most, std::span<const TileBeliefs> objects, double depth,
                FollowedTiles& followed);

}  // namespace palpate
