#pragma once

#include <vector>

#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// Finds the bins that hold all but a tolerated part of the posterior, by branch and bound: tiles
/// of poses are bounded by TileBounds, dropped where they hold too little, and divided otherwise,
/// until the smallest tiles' bins are evaluated in the order of their bounds. docs/bounds_inside.md
/// has the bound, its proof and the certificate.
/// @param largest has taken in the task's elements
/// @param refined where not null, takes the tiles that are divided
SearchResult run_search(SearchTask task, const LargestTiles& largest,
                        std::vector<PoseBlock>* refined = nullptr);

/// The bins of a tile of this level.
PoseBlock block_of(const BinBox& box, std::size_t level);

}  // namespace palpate
