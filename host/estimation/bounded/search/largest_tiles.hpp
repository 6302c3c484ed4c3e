#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/search/search_space.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "estimation/known_elements.hpp"
#include "model/bounding_box.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

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

  /// The sums at one theta, less unseen(): [batch y, batch x, tile].
  const std::int32_t* sums(std::size_t hypothesis, std::size_t theta) const {
    return sums_[hypothesis].data() + theta * sums_[hypothesis].size() / space_.turns.size();
  }
  /// The sum of a tile in which every element sees the prior.
  std::int64_t unseen(std::size_t hypothesis) const { return unseen_[hypothesis]; }
  /// The largest log-likelihood that a displaced touch can have anywhere, in nats.
  /// @param touch in the order in which they were added
  double most(std::size_t touch, std::size_t hypothesis) const { return most_[touch][hypothesis]; }
  /// Host memory, in bytes.
  std::uint64_t bytes() const;

 private:
  /// Adds elements of which none is displaced.
  void add_exact(const KnownElements& known, const std::vector<std::int64_t>& offsets);
  /// Adds a displaced touch.
  void add_displaced(const KnownElements& touch, const std::vector<std::int64_t>& offsets);
  /// Adds what tiles' elements have to their sums, less what they would have if they saw the prior.
  template <typename Penalty>
  void raise(std::int32_t* sums, std::span<const Penalty> added, std::int64_t offset) const;
  /// Runs add(offsets), where these are [hypothesis] what the elements add to unseen(). Most tiles
  /// of a large region do not see the map: sums count from what such a tile would have.
  template <typename Add>
  void with_offsets(const KnownElements& known, const Add& add);

  const SearchSpace& space_;
  std::vector<std::vector<std::int32_t>> sums_;  ///< [hypothesis][theta, batch y, batch x, tile]
  std::vector<std::int64_t> unseen_;             ///< [hypothesis]
  std::vector<std::vector<double>> most_;        ///< [displaced touch][hypothesis]
};

/// The box around the elements, from the pivot, at every theta.
/// @param turns [theta] its cosine and sine
std::vector<BoundingBox> reaches_of(const KnownElements& elements,
                                    std::span<const glm::dvec2> turns);

/// The tiles in which an element may see something else than the prior, at one theta; none without
/// elements. In all others every bin has the same likelihood.
/// @param reach of the elements at this theta
TileRange seen_tiles(const BoundingBox& reach, const OccupancyGrid& map, const TileLevel& level);

}  // namespace palpate
