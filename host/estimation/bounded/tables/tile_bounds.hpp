#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/known_elements.hpp"
#include "estimation/bounded/tables/tile_levels.hpp"
#include "estimation/bounded/tables/tile_penalties.hpp"
#include "estimation/bounded/tables/window_table.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// What bounds the likelihood over the tiles of one object: the levels of tiles, and a window table
/// of each level for every reading.
class TileBounds {
 public:
  /// @param contact resolved: with its prior
  TileBounds(const OccupancyGrid& map, const ContactModel& contact, std::size_t object,
             const PoseLattice& lattice, const std::vector<TileSize>& sizes);

  std::span<const TileLevel> levels() const { return levels_; }
  std::int64_t bins(std::size_t level, const Tile& tile) const {
    return std::int64_t{levels_[level].x.bins(tile.x)} * levels_[level].y.bins(tile.y);
  }

  /// Places the elements for the tiles of a level at one theta.
  /// @param turn cosine and sine of theta
  void place(std::size_t level, const glm::dvec2& turn, const KnownElements& elements,
             WindowPlaces& placed) const;
  /// Adds the elements' penalties to the sums of the batch of tiles whose first tile this is, and
  /// of its neighbours along x; see add_penalties().
  void add(std::size_t level, const KnownElements& elements, const WindowPlaces& placed,
           int first_x, int first_y, std::uint32_t* sums, int batches = 1) const;
  /// Makes add_changes() possible.
  void make_change_tables();
  /// What add() adds for known_elements() of a touch, given what it adds, in `sums`, where all of
  /// the touch's elements are in No Contact. Where the sums stay below largest_sum, bit for bit.
  /// @param changed changed_elements() of the touch, placed for the largest tiles
  void add_changes(const KnownElements& changed, const WindowPlaces& placed, int first_x,
                   int first_y, std::uint32_t* sums, int batches = 1) const;
  /// The sum of the elements' penalties where all of them see the prior.
  std::uint32_t penalty_beyond(std::size_t level, const KnownElements& elements) const;
  /// Log-likelihood of the elements without any penalty, in nats.
  double best(std::size_t level, const KnownElements& elements) const;

  std::size_t bytes() const;

 private:
  const ChangeTable& change(Reading reading) const {
    return changes_[reading == Reading::unknown ? 0 : static_cast<std::size_t>(reading)];
  }
  const WindowTable& table(std::size_t level, Reading reading) const {
    return tables_[level][static_cast<std::size_t>(reading)];
  }

  std::vector<TileLevel> levels_;
  std::vector<std::vector<WindowTable>> tables_;  ///< [level][reading]
  /// How the largest tiles' bounds change from No Contact: to Unknown, which stands in the place of
  /// No Contact, and to the other readings. Empty before make_change_tables().
  std::vector<ChangeTable> changes_;
  glm::dvec2 corner_mm_;  ///< of the first tile, from the map's square 0
};

}  // namespace palpate
