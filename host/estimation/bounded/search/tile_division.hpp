#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/search/largest_tiles.hpp"
#include "estimation/bounded/search/mass_account.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/bounded/touch_overlap.hpp"
#include "model/bounding_box.hpp"

namespace palpate {

/// Tiles of each level that are followed down to the bins, to know early how much mass there is.
inline constexpr std::size_t beam_tiles = 64;

bool larger_first(const Tile& a, const Tile& b);
/// Sorts before another by object, theta, y, x.
bool stands_before(const Tile& a, const Tile& b);
/// Keeps the tiles of the largest bounds.
void keep_best(std::vector<Tile>& tiles, std::size_t count);
/// Whether a tile is one of the parts, one level down, of another.
bool is_part(const Tile& part, const Tile& of);

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
  /// Calls visit(box) for the bins of all largest tiles in which every element sees the prior.
  template <typename Visit>
  void for_unseen(const Visit& visit) const;
  /// Log-likelihood of the elements where all of them see the prior, in nats.
  double prior_log_likelihood(std::int32_t object) const {
    return prior_log_likelihoods_[static_cast<std::size_t>(object)];
  }
  /// The seen tile of the largest bound of every object and theta.
  std::vector<Tile> best_of_largest();
  /// The seen largest tiles of a larger bound than this.
  std::vector<Tile> largest_above(double bound) const;
  /// Counts the bins of the largest tiles.
  void count_largest(UnsettledMass& unsettled) const;
  /// Takes those that lie before the slots `end`, [object], out of the unsettled ones.
  std::vector<Tile> take_largest(std::span<const std::size_t> end, UnsettledMass& unsettled) const;

  /// The parts, one level down, of tiles that are sorted by place. Leaves out those in which every
  /// element sees the prior.
  /// @param unseen where not null, takes these
  std::vector<Tile> parts_of(std::span<const Tile> tiles, std::size_t level,
                             std::vector<Tile>* unseen = nullptr);
  /// Tiles whose bounds are below are not looked at more closely than to know that: where touches
  /// are uncertain, the last touches may be left out.
  void set_negligible(double bound) { negligible_ = bound; }

  /// Follows tiles of a level down to the smallest ones, the best of each level.
  /// @param width so many tiles at first
  /// @returns a few of the smallest, to learn from their bins how much mass there is at least
  std::vector<Tile> best_smallest(std::vector<Tile> tiles, std::size_t level,
                                  std::size_t width = beam_tiles);

  /// Number of tiles that were bounded.
  std::int64_t bounded() const { return bounded_; }

 private:
  /// Calls visit(sum, x, y, bins) for the largest tiles of an object and theta that hold bins, see
  /// the map and have a smaller sum than `end_sum`, which visits may lower.
  template <typename Visit>
  void for_largest(std::size_t row, const std::int64_t& end_sum, const Visit& visit) const;
  /// The bound of a tile, from the sum of its elements' penalties.
  double bound_of(std::size_t object, std::size_t level, std::int64_t penalties) const;
  /// The bound of a largest tile, from the sum that LargestTiles keeps.
  double bound_of_largest(std::size_t object, std::int32_t sum) const;
  /// The least sum of a largest tile whose slot is not before this one: slots ascend with sums.
  std::int64_t least_sum(const UnsettledMass& unsettled, std::size_t object,
                         std::size_t slot) const;
  /// Whether any bin of a tile may count.
  bool may_count(const TileLevel& level, const Tile& tile) const {
    const TouchOverlap* counted = task_.goal.counted;
    return counted == nullptr || counted->may_hold(level.box_of(tile));
  }
  /// Where touches are uncertain, the sums of their penalties over the parts of tiles, [tile,
  /// part], which are tiles of this level; else empty.
  std::vector<std::int64_t> displaced_sums(std::span<const Tile> tiles, std::size_t level) const;
  /// Those of one object's tiles.
  void add_displaced(std::span<const Tile> tiles, std::size_t level,
                     std::span<std::int64_t> sums) const;
  /// Appends the tiles of a batch, at the object and theta of `of`, that hold bins.
  template <typename Sum>
  void append_batch(const Tile& of, std::size_t level, int first_x, int first_y, const Sum* sums,
                    std::vector<Tile>& tiles) const;

  const SearchTask& task_;
  const SearchSpace& space_;
  const LargestTiles& largest_;
  std::size_t thetas_;
  std::vector<BoundingBox> reaches_;              ///< [theta] of the elements
  std::vector<TileRange> seen_;                   ///< [object, theta]
  std::vector<std::vector<double>> unpenalised_;  ///< [object][level], with the prior weight
  std::vector<double> prior_log_likelihoods_;     ///< [object]
  double negligible_ = -std::numeric_limits<double>::infinity();
  std::int64_t bounded_ = 0;
};

template <typename Visit>
void TileDivision::for_unseen(const Visit& visit) const {
  for (std::size_t row = 0; row < seen_.size(); ++row) {
    const std::size_t object = row / thetas_;
    const TileLevel& level = space_.bounds[object].levels().front();
    const TileRange& seen = seen_[row];
    const int nx = level.x.tiles();
    for (const TileRange& unseen :
         {TileRange{0, nx, 0, seen.y_first}, TileRange{0, seen.x_first, seen.y_first, seen.y_end},
          TileRange{seen.x_end, nx, seen.y_first, seen.y_end},
          TileRange{0, nx, seen.y_end, level.y.tiles()}}) {
      const BinBox box = level.box_of(static_cast<std::int32_t>(object),
                                      static_cast<std::int32_t>(row % thetas_), unseen);
      if (box.bins() > 0) {
        visit(box);
      }
    }
  }
}

}  // namespace palpate
