#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/leaves/bin_likelihood.hpp"
#include "estimation/bounded/search/leaf_evaluator.hpp"
#include "estimation/bounded/search/resting_array.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "palpate/bounded_posterior.hpp"

namespace palpate {

/// Finds the bins that hold all but a tolerated part of the posterior, by branch and bound: tiles
/// of poses are bounded by TileBounds, dropped where they hold too little, and divided otherwise,
/// until the smallest tiles' bins are evaluated in the order of their bounds.
class BoundSearch {
 public:
  /// @param options checked, with a resolved contact model
  /// @param likelihood evaluates bins; all of these outlive the search
  BoundSearch(SearchSpace& space, const BoundedOptions& options, const BinLikelihood& likelihood);

  /// Forgets all touches.
  void reset();
  /// Adds the penalties of more touches to the sums of the largest tiles.
  /// @param touches [touch]
  void add(std::span<const ArrayReadings> touches);
  /// The same of elements that may be of any touches.
  void add(const KnownElements& elements);
  /// @param elements all that were added since reset()
  /// @param deadline after which tiles are dropped unseen
  /// @param refined where not null, takes the tiles that were divided
  SearchResult run(const KnownElements& elements, const SearchGoal& goal, const Deadline& deadline,
                   const BinVisitor& visit, std::vector<PoseBlock>* refined = nullptr) const;

  /// Sums of the penalties of a hypothesis's largest tiles, [theta, batch y, batch x, tile].
  std::vector<std::int64_t> largest_sums(std::size_t hypothesis) const;
  /// The level of the smallest tiles, 0 that of the largest.
  int finest_level() const { return static_cast<int>(space_.bounds.front().levels().size()) - 1; }
  /// Host memory of its own sums, in bytes.
  std::uint64_t bytes() const;

 private:
  friend class SearchRun;

  /// Neighbouring batches of the largest tiles along x, at one theta.
  struct Strip {
    std::size_t object = 0;
    std::size_t first = 0;  ///< index of their sums
    int x = 0;              ///< tile at their corner
    int y = 0;
    int batches = 0;
    const WindowPlaces& placed;
  };

  void add_touch(const ArrayReadings& touch);
  /// Keeps the sums of an array at rest.
  void keep_rest(const KnownElements& at_rest);
  /// Adds what sum_of(strip, sums) finds for the batches that see the map.
  /// @param known the touch's elements, `placed` those whose places a strip holds
  template <typename Sum>
  void add_sums(const KnownElements& known, const KnownElements& placed, const Sum& sum_of);
  /// Calls visit(strip), in parallel, for the batches in which one of the `known` elements may see
  /// the map.
  template <typename Visit>
  void for_seen(const KnownElements& known, const KnownElements& placed, const Visit& visit) const;

  SearchSpace& space_;
  const BoundedOptions& options_;
  const BinLikelihood& likelihood_;
  /// Sums of penalties of the largest tiles, [hypothesis][theta, batch y, batch x, tile], less
  /// those of a tile in which every element sees the prior.
  std::vector<std::vector<std::int32_t>> largest_tiles_;
  std::vector<std::int64_t> unseen_;  ///< [hypothesis] these
  RestingArray resting_;
  /// Sums of all elements of the array at rest in No Contact, whole.
  std::vector<std::vector<std::uint32_t>> rest_tiles_;
};

}  // namespace palpate
