#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "estimation/bounded/search/item_bounds.hpp"
#include "estimation/bounded/search/mass_account.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"
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

  /// The bins of all largest tiles in which every element sees the prior: all have the same
  /// likelihood. The others are seen.
  std::vector<BinBox> off_map() const;
  /// Log-likelihood of the elements where all of them see the prior, in nats.
  double prior_log_likelihood(std::int32_t object) const {
    return prior_log_likelihoods_[static_cast<std::size_t>(object)];
  }

  /// The seen largest tile of the largest bound of every object and theta.
  std::vector<Tile> best_of_largest();
  /// The seen largest tiles of at least this bound, sorted by place.
  std::vector<Tile> largest_above(double bound) const;

  /// The parts, one level down, of tiles that are sorted by place. Leaves out those in which every
  /// element sees the prior.
  /// @param off_map where not null, takes these
  std::vector<Tile> parts_of(std::span<const Tile> tiles, std::size_t level,
                             std::vector<Tile>* off_map = nullptr);
  /// Tiles whose bounds are below are not looked at more closely than to know that: the last items
  /// may be left out.
  void set_negligible(double bound) { negligible_ = bound; }

  /// Follows tiles of a level down to the smallest ones, the best of each level.
  /// @param width so many tiles at first
  /// @returns a few of the smallest, to learn from their bins how much mass there is at least
  std::vector<Tile> best_smallest(std::vector<Tile> tiles, std::size_t level,
                                  std::size_t width = beam_tiles);

  /// Number of tiles that were bounded.
  std::int64_t bounded() const { return bounded_; }

 private:
  /// Calls visit(sum, tile) for the largest tiles of an object and theta that hold bins, see the
  /// map and have a smaller sum than `end_sum`, which visits may lower.
  template <typename Visit>
  void for_largest(std::size_t row, const std::int64_t& end_sum, const Visit& visit) const;
  /// The bound of a tile, from the sum of its elements' penalties.
  double bound_of(std::size_t object, std::size_t level, std::int64_t penalties) const {
    return unpenalised_[object][level] - static_cast<double>(penalties) / penalties_per_nat;
  }
  /// The bound of a largest tile, from the sum that LargestTiles keeps.
  double bound_of_largest(std::size_t object, std::int32_t sum) const {
    return bound_of(object, 0, largest_.off_map(object) + sum);
  }
  /// The sums of the elements' penalties over the parts of one object's tiles, [tile, x, y].
  /// @param level of the parts
  std::vector<std::int64_t> sums_of_parts(std::span<const Tile> tiles, std::size_t level) const;
  /// Appends the parts of one object's tiles; see parts_of().
  /// @param level of the parts
  void append_parts(std::span<const Tile> tiles, std::size_t level, std::vector<Tile>& parts,
                    std::vector<Tile>* off_map) const;

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

}  // namespace palpate
