#pragma once

#include <vector>

#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/largest_tiles.hpp"
#include "estimation/bounded/search/search_goal.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// Finds the bins that hold all but a tolerated part of the posterior, by branch and bound: tiles
/// of poses are bounded by TileBounds, dropped where they hold too little, and divided otherwise,
/// until the smallest tiles' bins are evaluated in the order of their bounds. docs/bounds_inside.md
/// has the bound, its proof and the certificate.
class BoundSearch {
 public:
  /// @param options checked, with a resolved contact model
  /// @param likelihood evaluates bins; all of these outlive the search
  BoundSearch(const SearchSpace& space, const BoundedOptions& options,
              const BinLikelihood& likelihood)
      : space_(space), options_(options), likelihood_(likelihood), largest_(space) {}

  /// The largest tiles, which take in the touches.
  LargestTiles& largest() { return largest_; }
  const LargestTiles& largest() const { return largest_; }

  /// @param elements all that the largest tiles took in
  /// @param deadline after which tiles are dropped unseen
  /// @param refined where not null, takes the tiles that were divided
  SearchResult run(const KnownElements& elements, const SearchGoal& goal, const Deadline& deadline,
                   const BinVisitor& visit, std::vector<PoseBlock>* refined = nullptr) const;

 private:
  const SearchSpace& space_;
  const BoundedOptions& options_;
  const BinLikelihood& likelihood_;
  LargestTiles largest_;
};

/// The bins of a tile of this level.
PoseBlock block_of(const BinBox& box, std::size_t level);

}  // namespace palpate
