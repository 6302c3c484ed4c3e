#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/displaced/displacement_mean.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"

namespace palpate {

/// Gives the negative of lower bounds of a touch's penalties over tiles of one level, in nats, as
/// if the touch's pose were exact: relative to TileBounds::best().
/// @param space,touch outlive the result
PlaceSource<float> exact_penalties(const SearchSpace& space, std::size_t object, std::size_t level,
                                   const KnownElements& touch);

/// Lower bounds of a touch's penalties over tiles of one level, where it is displaced: those of
/// its mean likelihood. Below 0 where the mean may exceed what TileBounds::best() says.
/// @param touch one of KnownElements::touches
/// @param targets batches of the level's tiles, sorted by theta, y, x
/// @returns [run, batch, tile] as add_penalties() orders a batch's tiles
std::vector<std::int32_t> displaced_penalties(const SearchSpace& space, std::size_t object,
                                              std::size_t level, const KnownElements& touch,
                                              std::span<const BlockRun> targets);

/// The box in which the elements lie at every theta, from the pivot, wherever their sensors may
/// have been.
/// @param touches KnownElements::touches
std::vector<BoundingBox> displaced_reaches(const SearchSpace& space,
                                           std::span<const KnownElements> touches);

}  // namespace palpate
