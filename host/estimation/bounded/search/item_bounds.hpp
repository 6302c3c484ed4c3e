#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/displaced/places.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"
#include "model/bounding_box.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

// A search asks four things of its evidence, item by item (KnownElements::items()): all
// undisplaced touches together are one item, each displaced touch is one. Likelihoods of items
// multiply, so that what these return adds up:
//
//   penalties_of()               lower bounds of the item's penalties over tiles of any level
//   reaches_of()                 where its elements may lie, and so which tiles may see the map
//   BinLikelihood::evaluate()    the log-likelihood at bins, of all items
//   BinLikelihood::error()       the bound of its rounding

/// Lower bounds of an item's penalties over batches of tiles of one level, relative to
/// TileBounds::best(). Those of a displaced touch are of its mean likelihood; they lie below 0
/// where the mean may exceed what best() says.
/// @param batches sorted by theta, y, x
/// @returns [run, batch, tile] as add_penalties() orders a batch's tiles
std::vector<std::int32_t> penalties_of(const KnownElements& item, const SearchSpace& space,
                                       std::size_t object, std::size_t level,
                                       std::span<const BlockRun> batches);

/// The box in which the elements of all items lie at every theta, from the pivot, wherever their
/// sensors may have been.
std::vector<BoundingBox> reaches_of(const KnownElements& elements, const SearchSpace& space);

/// The box around the elements where the robot says that they lie, from the pivot, at every theta.
/// @param turns [theta] its cosine and sine
std::vector<BoundingBox> undisplaced_reaches(const KnownElements& elements,
                                             std::span<const glm::dvec2> turns);

/// The tiles in which an element may see something else than the prior, at one theta; none without
/// elements. In all others every bin has the same likelihood.
/// @param reach of the elements at this theta
TileRange seen_tiles(const BoundingBox& reach, const OccupancyGrid& map, const TileLevel& level);

/// The sums of all elements' penalties over the largest tiles of every hypothesis. They are kept
/// between touches, so that a touch adds only its own.
class LargestTiles {
 public:
  /// @param space outlives this object
  explicit LargestTiles(const SearchSpace& space);

  /// Forgets all touches.
  void reset();
  void add(std::span<const KnownElements> touches);
  /// Adds elements that may be of any touches.
  void add(const KnownElements& elements);

  /// The sums at one theta, less off_map(): [batch y, batch x, tile].
  const std::int32_t* sums(std::size_t hypothesis, std::size_t theta) const {
    return sums_[hypothesis].data() + theta * sums_[hypothesis].size() / space_.turns.size();
  }
  /// The sum of a tile in which every element sees the prior. Most tiles of a large region do not
  /// see the map: sums count from what such a tile has.
  std::int64_t off_map(std::size_t hypothesis) const { return off_map_[hypothesis]; }
  /// The largest log-likelihood that an item can have anywhere, in nats.
  /// @param item in the order in which items with known elements were added
  double upper_bound(std::size_t item, std::size_t hypothesis) const {
    return upper_bounds_[item][hypothesis];
  }
  /// Host memory, in bytes.
  std::uint64_t bytes() const;

 private:
  const SearchSpace& space_;
  std::vector<std::vector<std::int32_t>> sums_;    ///< [hypothesis][theta, batch y, batch x, tile]
  std::vector<std::int64_t> off_map_;              ///< [hypothesis]
  std::vector<std::vector<double>> upper_bounds_;  ///< [item][hypothesis]
};

}  // namespace palpate
