#include "tile_bounds.hpp"

#include <algorithm>

#include <tbb/parallel_for.h>

#include "reading_penalties.hpp"

namespace palpate {

TileBounds::TileBounds(const OccupancyGrid& map, const ContactModel& contact, std::size_t object,
                       const PoseLattice& lattice, const std::vector<TileSize>& sizes)
    : levels_(tile_levels(lattice, map.cell_mm, sizes)),
      // Square 0 lies between the first node and the prior's node before it.
      corner_mm_(glm::dvec2(lattice.x_mm.centre(0), lattice.y_mm.centre(0)) - map.origin_mm +
                 map.cell_mm),
      cell_mm_(map.cell_mm) {
  const std::size_t readings = contact.table ? contact.table->levels() : 2;
  tables_.assign(levels_.size(), std::vector<WindowTable>(readings));
  tbb::parallel_for(std::size_t{0}, readings, [&](std::size_t reading) {
    SquarePenalties penalties{.parts = 0, .least = {}};
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      const TileSize& size = levels_[level].size;
      if (penalties.parts != size.parts) {
        penalties =
            square_penalties(map, contact, static_cast<Reading>(reading), object, size.parts);
      }
      tables_[level][reading] = size.merged == 1
                                    ? window_table(penalties, size.side)
                                    : window_table(merged(penalties, size.merged), size.side);
    }
  });
}

void TileBounds::place(std::size_t level, const glm::dvec2& turn, const KnownElements& elements,
                       WindowPlaces& placed) const {
  place_elements(elements,
                 {.turn = turn,
                  .corner_mm = corner_mm_,
                  .square_mm = cell_mm_ * levels_[level].size.square_cells()},
                 tables_[level].front(), placed);
}

void TileBounds::add(std::size_t level, const KnownElements& elements, const WindowPlaces& placed,
                     int first_x, int first_y, std::uint32_t* sums) const {
  for (const ReadingRun& run : elements.runs) {
    add_penalties(placed, run, table(level, run.reading), first_x, first_y, sums);
  }
}

std::uint32_t TileBounds::penalty_beyond(std::size_t level, const KnownElements& elements) const {
  std::uint64_t sum = 0;
  for (const ReadingRun& run : elements.runs) {
    sum += (run.end - run.begin) * std::uint64_t{table(level, run.reading).beyond};
  }
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(sum, largest_sum));
}

double TileBounds::best(std::size_t level, const KnownElements& elements) const {
  double sum = 0.0;
  for (const ReadingRun& run : elements.runs) {
    sum += static_cast<double>(run.end - run.begin) * table(level, run.reading).best;
  }
  return sum;
}

std::size_t TileBounds::bytes() const {
  std::size_t bytes = 0;
  for (const std::vector<WindowTable>& level : tables_) {
    for (const WindowTable& table : level) {
      bytes += table.bytes();
    }
  }
  return bytes;
}

}  // namespace palpate
