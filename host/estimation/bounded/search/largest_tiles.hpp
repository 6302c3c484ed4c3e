#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "model/bounding_box.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// Tells whether an array stays where it is from touch to touch. What all of its elements in No
/// Contact add to sums is then worth keeping: a touch adds only what its other elements change.
class StillPlace {
 public:
  enum class Seen {
    moving,   ///< the touch must be added whole
    stopped,  ///< sums of this place are worth keeping from this touch on
    still,    ///< at the place whose sums are kept
  };

  /// Looks at the next touch. Where it stopped, no sums are kept before keep().
  Seen look(const ArrayReadings& touch);
  /// The sums of the last touch's place are kept from now on.
  void keep() { kept_ = last_; }

 private:
  std::vector<glm::dvec2> last_;  ///< places of the last touch's elements
  std::vector<glm::dvec2> kept_;  ///< of those whose sums are kept
};

/// The sums of all elements' penalties over the largest tiles of every hypothesis. They are kept
/// between touches, so that a touch adds only its own.
class LargestTiles {
 public:
  /// @param space outlives this object
  explicit LargestTiles(SearchSpace& space);

  /// Forgets all touches.
  void reset();
  void add(std::span<const ArrayReadings> touches);
  /// Touches that were added since reset().
  std::size_t touches() const { return touches_; }
  /// Adds elements that may be of any touches.
  void add(const KnownElements& elements);

  /// The sums at one theta, less unseen(): [batch y, batch x, tile].
  const std::int32_t* sums(std::size_t hypothesis, std::size_t theta) const {
    return sums_[hypothesis].data() + theta * sums_[hypothesis].size() / space_.turns.size();
  }
  /// The sum of a tile in which every element sees the prior.
  std::int64_t unseen(std::size_t hypothesis) const { return unseen_[hypothesis]; }
  /// The largest log-likelihood that a touch of uncertain pose can have anywhere, in nats.
  /// @param touch in the order in which they were added
  double most(std::size_t touch, std::size_t hypothesis) const { return most_[touch][hypothesis]; }
  /// Host memory, in bytes.
  std::uint64_t bytes() const;

 private:
  /// Neighbouring batches along x, at one theta.
  struct Strip {
    std::size_t object = 0;
    std::size_t first = 0;  ///< index of their sums
    int x = 0;              ///< tile at their corner
    int y = 0;
    int batches = 0;
    const WindowPlaces& placed;
  };

  void add_touch(const ArrayReadings& touch);
  /// Adds what one touch of uncertain pose adds.
  void add_displaced(const KnownElements& touch);
  /// [hypothesis] what the elements add to unseen(). Most tiles of a large region do not see the
  /// map: sums count from what such a tile would have.
  std::vector<std::int64_t> offsets_of(const KnownElements& known) const;
  void raise_unseen(const std::vector<std::int64_t>& offsets);
  /// Keeps the sums of an array that stays and is wholly in No Contact.
  void keep_still(const KnownElements& no_contact);
  /// Adds what sum_of(strip, sums) finds for the batches that see the map.
  /// @param known the touch's elements, `placed` those whose places a strip holds
  template <typename Sum>
  void add_sums(const KnownElements& known, const KnownElements& placed, const Sum& sum_of);
  /// Calls visit(strip), in parallel, for the batches in which one of the `known` elements may see
  /// the map.
  template <typename Visit>
  void for_seen(const KnownElements& known, const KnownElements& placed, const Visit& visit) const;

  SearchSpace& space_;
  std::size_t touches_ = 0;
  std::vector<std::vector<std::int32_t>> sums_;  ///< [hypothesis][theta, batch y, batch x, tile]
  std::vector<std::int64_t> unseen_;             ///< [hypothesis]
  std::vector<std::vector<double>> most_;        ///< see most()
  StillPlace still_;
  /// Whole sums of a still array in No Contact, [hypothesis], as sums_.
  std::vector<std::vector<std::uint32_t>> still_sums_;
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
