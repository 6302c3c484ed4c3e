#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bin_box.hpp"
#include "estimation/bounded/tables/window_table.hpp"
#include "estimation/known_elements.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose.hpp"

namespace palpate {

/// A tile of one object's poses, and the largest log-likelihood, with the prior weight, that a bin
/// in it can have.
struct Tile {
  double bound = 0.0;
  std::int32_t object = 0;
  std::int32_t theta = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;
};

/// Tiles [first, end) along each axis.
struct TileRange {
  int x_first = 0;
  int x_end = 0;
  int y_first = 0;
  int y_end = 0;

  bool holds(const Tile& tile) const {
    return tile.x >= x_first && tile.x < x_end && tile.y >= y_first && tile.y < y_end;
  }
};

/// The size of a level's tiles: `side` squares, each of so many cells of the map along an axis. Or
/// a tile has as many `bins` along each axis: squares then divide the lattice's steps, however
/// large the map's cells are.
struct TileSize {
  double square_cells = 1.0;
  int side = 1;
  int bins = 0;  ///< 0: as the map's cells have it

  /// Squares along an axis that an element can see while the pose is in one tile, or at one of its
  /// bins' centres.
  int window() const { return bins == 0 ? side + 1 : ((bins - 1) * side + bins - 1) / bins + 1; }
  double cells() const { return side * square_cells; }
};

/// Tiles along one axis of the lattice. They begin at the first bin's centre; a tile holds the bins
/// whose centres lie in it, which may be none.
struct TileAxis {
  double first_mm = 0.0;       ///< centre of the lattice's first bin
  double side_mm = 0.0;        ///< of a tile
  std::vector<int> first_bin;  ///< [tiles + 1]; tiles come in whole batches

  int tiles() const { return static_cast<int>(first_bin.size()) - 1; }
  int bins(int tile) const { return first_bin[tile + 1] - first_bin[tile]; }
  /// Number of tiles in [first, end) that hold bins.
  std::int64_t tiles_with_bins(int first, int end) const {
    std::int64_t count = 0;
    for (int tile = first; tile < end; ++tile) {
      count += bins(tile) > 0 ? 1 : 0;
    }
    return count;
  }
};

/// One level of tiles over one object's poses, the same for every theta.
struct TileLevel {
  TileSize size;
  glm::dvec2 square_mm;
  TileAxis x;
  TileAxis y;

  int batches_x() const { return x.tiles() / 4; }
  int batches_y() const { return y.tiles() / 4; }
  BinBox box_of(std::int32_t object, std::int32_t theta, const TileRange& tiles) const {
    return {.object = object,
            .theta = theta,
            .y_first = y.first_bin[tiles.y_first],
            .y_count = y.first_bin[tiles.y_end] - y.first_bin[tiles.y_first],
            .x_first = x.first_bin[tiles.x_first],
            .x_count = x.first_bin[tiles.x_end] - x.first_bin[tiles.x_first]};
  }
  BinBox box_of(const Tile& tile) const {
    return box_of(tile.object, tile.theta, {tile.x, tile.x + 1, tile.y, tile.y + 1});
  }
};

/// Sizes of the levels, the largest tiles first. Each level's tiles have a quarter of the side of
/// the level before, so that a batch of 4 x 4 tiles makes up one tile. Where bins are few and lie
/// cells apart, there is one level, of single bins: larger tiles would leave out few of them, and
/// bound them loosely. Where touches are displaced, all tiles have whole bins, and the smallest are
/// about half as wide as the standard deviation.
/// @param least_cell_mm of the maps
/// @param touch_sd how far touches may be displaced
std::vector<TileSize> tile_sizes(const PoseLattice& lattice, double least_cell_mm, std::size_t maps,
                                 const DisplacementSd& touch_sd = {});

/// The squares of a level over a map of this cell.
glm::dvec2 square_mm(const TileSize& size, const PoseLattice& lattice, double cell_mm);

/// Batches of tiles along an axis, but for one more where rounding asks for it.
double batches_along(const Axis& axis, const TileSize& size, double side_mm);

/// The levels of tiles over a lattice for a map of this cell.
std::vector<TileLevel> tile_levels(const PoseLattice& lattice, double cell_mm,
                                   const std::vector<TileSize>& sizes);

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
  /// Adds the elements' penalties to the sums of the batch of tiles whose first tile this is; see
  /// add_penalties().
  void add(std::size_t level, const KnownElements& elements, const WindowPlaces& placed,
           int first_x, int first_y, std::uint32_t* sums) const;
  /// The sum of the elements' penalties where all of them see the prior.
  std::uint32_t penalty_beyond(std::size_t level, const KnownElements& elements) const;
  /// Log-likelihood of the elements without any penalty, in nats.
  double best(std::size_t level, const KnownElements& elements) const;

  std::size_t bytes() const;

 private:
  const WindowTable& table(std::size_t level, Reading reading) const {
    return tables_[level][static_cast<std::size_t>(reading)];
  }

  std::vector<TileLevel> levels_;
  std::vector<std::vector<WindowTable>> tables_;  ///< [level][reading]
  glm::dvec2 corner_mm_;                          ///< of the first tile, from the map's square 0
};

}  // namespace palpate
