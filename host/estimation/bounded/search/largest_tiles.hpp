#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/search/search_space.hpp"
#include "estimation/known_elements.hpp"

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
