#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/search/largest_tiles.hpp"
#include "estimation/bounded/search/mass_account.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/bounded/touch_overlap.hpp"
#include "model/bounding_box.hpp"

namespace palpate {

/// The tiles of one search with their bounds: the largest ones, by the sums that LargestTiles
/// keeps, and the parts of any others.
class TileDivision {
 public:
  /// @param largest holds the sums of the task's elements
  TileDivision(const SearchTask& task, const LargestTiles& largest);

  /// The largest tiles in which an element may see something else than the prior. In all others
  /// every bin has the same likelihood.
  const TileRange& seen(std::size_t object, std::size_t theta) const {
    return seen_[object * thetas_ + theta];
  }
  /// The seen tile of the largest bound of every object and theta.
  std::vector<Tile> best_of_largest();
  /// Counts the bins of the largest tiles.
  void count_largest(UnsettledMass& unsettled) const;
  /// Takes those that lie before the slots `end`, [object], out of the unsettled ones.
  std::vector<Tile> take_largest(std::span<const std::size_t> end, UnsettledMass& unsettled) const;

  /// The parts, one level down, of tiles that are sorted by place. Leaves out those in which every
  /// element sees the prior.
  /// @param unseen where not null, takes these
  std::vector<Tile> parts_of(std::span<const Tile> tiles, std::size_t level,
                             std::vector<Tile>* unseen = nullptr);

  /// Number of tiles that were bounded.
  std::int64_t bounded() const { return bounded_; }

 private:
  /// Calls visit(sum, x, y, bins) for the largest tiles of an object and theta that hold bins and
  /// see the map.
  template <typename Visit>
  void for_largest(std::size_t row, const Visit& visit) const;
  /// The bound of a largest tile, from the sum that LargestTiles keeps.
  double bound_of(std::size_t object, std::int32_t sum) const;
  /// The least sum of a largest tile whose slot is not before this one: slots ascend with sums.
  std::int64_t least_sum(const UnsettledMass& unsettled, std::size_t object,
                         std::size_t slot) const;
  /// Whether any bin of a tile may count.
  bool may_count(const TileLevel& level, const Tile& tile) const {
    return counted_ == nullptr || counted_->may_hold(level.box_of(tile));
  }
  /// Appends the tiles of a batch, at the object and theta of `of`, that hold bins.
  void append_batch(const Tile& of, std::size_t level, int first_x, int first_y,
                    const std::uint32_t* sums, std::vector<Tile>& tiles) const;

  const SearchSpace& space_;
  const LargestTiles& largest_;
  const KnownElements& elements_;
  const TouchOverlap* counted_;  ///< the bins that count; null where all do
  std::size_t thetas_;
  std::vector<BoundingBox> reaches_;              ///< [theta] of the elements
  std::vector<TileRange> seen_;                   ///< [object, theta]
  std::vector<std::vector<double>> unpenalised_;  ///< [object][level], with the prior weight
  std::int64_t bounded_ = 0;
};

}  // namespace palpate
