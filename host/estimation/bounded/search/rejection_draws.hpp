#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "estimation/bounded/search/largest_tiles.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "model/random.hpp"

namespace palpate {

/// A bin of one object's lattice.
struct DrawnBin {
  std::int32_t object = 0;
  std::int64_t bin = 0;

  /// By which draws are sorted.
  std::pair<std::int32_t, std::int64_t> place() const { return {object, bin}; }
};

/// Draws bins of a belief without a search: by rejection under the tiles' bounds, which are refined
/// where a draw falls (adaptive rejection sampling; Dymetman, Bouchard and Carter 2012). Few draws
/// of a wide belief look at few of its bins.
///
/// A tile with n bins and the bound U is proposed with the weight n e^U. The proposal goes on to
/// one of the tile's parts by their weights, or is rejected with the probability that these leave;
/// a bin whose likelihood has been evaluated is accepted. Accepted bins have exactly the belief's
/// distribution, but for bins that hold less than a hundredth of it together and are left out.
/// @param largest holds the sums of the task's elements
/// @returns the draws, sorted; the same on any number of threads
std::vector<DrawnBin> draw_bins(const SearchTask& task, const LargestTiles& largest,
                                std::size_t count, Random& random);

}  // namespace palpate
