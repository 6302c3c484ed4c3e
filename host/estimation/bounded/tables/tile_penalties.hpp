#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimation/bounded/tables/window_table.hpp"
#include "estimation/known_elements.hpp"
#include "palpate/pose.hpp"

namespace palpate {

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
