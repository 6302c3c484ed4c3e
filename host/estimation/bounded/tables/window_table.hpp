#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimation/bounded/tables/reading_penalties.hpp"

namespace palpate {

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
  std::size_t bytes() const { return entries.capacity() * sizeof(std::uint16_t); }
};

/// @param side a power of two
/// @param window squares along each axis that an element can see: side + 1, or 1 where the pose
/// stays at the tile's corner
WindowTable window_table(const SquarePenalties& penalties, int side, int window);

/// What elements add to sums of penalties where they have one reading instead of another: the
/// difference of the penalties, and the same `offset` at all entries, which makes it positive.
struct ChangeTable {
  WindowTable table;
  std::uint16_t offset = 0;
};

/// @param to null for Unknown, which has no penalty
/// @param from a table of the same shape
ChangeTable change_table(const WindowTable* to, const WindowTable& from);

}  // namespace palpate
