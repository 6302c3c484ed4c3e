#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "estimation/known_elements.hpp"
#include "model/extremes.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A map with one node of the prior around it, divided into equal rectangles, its squares: the
/// range of the log odds, bilinear between the nodes, in each.
struct MapSquares {
  int nx = 0;
  int ny = 0;
  std::vector<Extremes> ranges;  ///< [ny, nx] in nats
};

/// Squares of any size. The last of a row or column may reach beyond the map.
MapSquares map_squares(const OccupancyGrid& map, double prior_log_odds,
                       const glm::dvec2& square_mm);

/// Penalties are whole multiples of 1 / penalties_per_nat nats.
inline constexpr double penalties_per_nat = 256.0;
/// The largest penalty of an element; larger ones count as much, which leaves bounds true.
inline constexpr std::uint16_t largest_penalty = 32767;

/// The least penalty of one reading in every square of a map: how much less likely the reading is
/// at least, at any place within the square, than at the map's most likely place.
struct SquarePenalties {
  double best = 0.0;  ///< log-likelihood of the reading at the most likely place, in nats
  int nx = 0;
  int ny = 0;
  std::vector<std::uint16_t> least;  ///< [ny, nx], rounded down
  std::uint16_t beyond = 0;          ///< where the map holds only the prior
};

/// Any likelihood will do: its extremes over the range of a square's log odds are sought, and
/// nothing is taken for monotone.
/// @param contact resolved: with its prior
SquarePenalties square_penalties(const MapSquares& squares, const ContactModel& contact,
                                 Reading reading, std::size_t object);

/// Tiles along one axis whose bounds one vector load gives.
inline constexpr int batch_side = 4;
inline constexpr int batch_tiles = batch_side * batch_side;

/// The least penalty of one reading within the window of squares that an element can see while the
/// pose moves through a tile of `side` x `side` squares, for every square at which the window may
/// begin.
///
/// Tiles of a row begin `side` squares apart, so that they need the same phase (the first square
/// modulo the side). Each phase has a plane of its own, in which neighbouring entries belong to
/// neighbouring tiles; an entry holds four rows, so that 16 numbers from one place on are those of
/// 4 x 4 tiles.
struct WindowTable {
  double best = 0.0;  ///< SquarePenalties::best
  int side = 1;       ///< of a tile, in squares; a power of two
  int side_log2 = 0;
  int columns = 0;  ///< of a plane
  int rows = 0;
  std::uint16_t largest = 0;           ///< of all entries
  std::uint16_t beyond = 0;            ///< where a window sees only the prior
  std::vector<std::uint16_t> entries;  ///< [phase y, phase x, row, column, 4]

  /// Entry of a plane at which a window stands that begins at square 0 of phase 0: smaller windows
  /// lie below the map.
  static constexpr int margin = batch_side + 1;
};

/// @param side a power of two
/// @param window squares along each axis that an element can see: side + 1, or 1 where the pose
/// stays at the tile's corner
WindowTable window_table(const SquarePenalties& penalties, int side, int window);

/// The elements of a level's tiles at one theta: for every element the plane of its phase and the
/// place in it for the first tile.
struct WindowPlaces {
  std::vector<std::int32_t> plane;  ///< index of the plane's first entry
  std::vector<std::int32_t> column;
  std::vector<std::int32_t> row;
};

/// Where tiles lie on a map: the first tile's corner, in mm from the map's square 0.
struct TilePlace {
  glm::dvec2 turn{1.0, 0.0};  ///< cosine and sine of theta
  glm::dvec2 corner_mm{0.0};
  glm::dvec2 square_mm{1.0};
};

/// Rotates the elements and finds their places in tables of this shape.
void place_windows(const KnownElements& elements, const TilePlace& place, const WindowTable& shape,
                   WindowPlaces& placed);

/// Sums of penalties do not grow beyond: so large a sum says all that there is to say.
inline constexpr std::uint32_t largest_sum = std::uint32_t{1} << 30;

/// Elements [begin, end) of a list, and the table of their reading.
struct TableRun {
  const WindowTable* table = nullptr;
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Sums the penalties of runs of elements over the 4 x 4 tiles of a batch, and adds them to `sums`,
/// where the sum of tile (i, j) stands at 4 i + j.
/// @param runs one after another, of tables of one shape
/// @param first_x, first_y tile at the batch's corner
void add_penalties(const WindowPlaces& placed, std::span<const TableRun> runs, int first_x,
                   int first_y, std::uint32_t* sums);

}  // namespace palpate
