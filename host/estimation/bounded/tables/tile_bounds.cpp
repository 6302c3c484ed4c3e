#include "estimation/bounded/tables/tile_bounds.hpp"

#include <algorithm>

#include "estimation/bounded/parallel_for.hpp"
#include "estimation/bounded/tables/reading_penalties.hpp"

namespace palpate {

TileBounds::TileBounds(const OccupancyGrid& map, const ContactModel& contact, std::size_t object,
                       const PoseLattice& lattice, const std::vector<TileSize>& sizes)
    : levels_(tile_levels(lattice, map.cell_mm, sizes)),
      // Square 0 lies between the first node and the prior's node before it.
      corner_mm_(glm::dvec2(lattice.x_mm.centre(0), lattice.y_mm.centre(0)) - map.origin_mm +
                 map.cell_mm) {
  const double prior_log_odds = log_odds_from_probability(*contact.prior);
  std::vector<MapSquares> squares;
  std::vector<std::size_t> squares_of;  // [level]
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    const TileSize& size = levels_[level].size;
    if (size.single_bin) {
      squares.push_back(squares_of_size(map, prior_log_odds, levels_[level].square_mm));
    } else if (level == 0 || size.parts != levels_[level - 1].size.parts) {
      squares.push_back(squares_of_cells(map, prior_log_odds, size.parts));
    }
    squares_of.push_back(squares.size() - 1);
  }
  const std::size_t readings = contact.table ? contact.table->levels() : 2;
  tables_.assign(levels_.size(), std::vector<WindowTable>(readings));
  parallel_for(readings, [&](std::size_t reading) {
    SquarePenalties penalties;
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      const TileSize& size = levels_[level].size;
      if (level == 0 || squares_of[level] != squares_of[level - 1]) {
        penalties = square_penalties(squares[squares_of[level]], contact,
                                     static_cast<Reading>(reading), object);
      }
      tables_[level][reading] =
          size.merged == 1 ? window_table(penalties, size.side, size.window())
                           : window_table(merged(penalties, size.merged), size.side, size.window());
    }
  });
}

void TileBounds::place(std::size_t level, const glm::dvec2& turn, const KnownElements& elements,
                       WindowPlaces& placed) const {
  place_elements(elements,
                 {.turn = turn, .corner_mm = corner_mm_, .square_mm = levels_[level].square_mm},
                 tables_[level].front(), placed);
}

void TileBounds::add(std::size_t level, const KnownElements& elements, const WindowPlaces& placed,
                     int first_x, int first_y, std::uint32_t* sums, int batches) const {
  for (const ReadingRun& run : elements.runs) {
    add_penalties(placed, run, table(level, run.reading), first_x, first_y, batches, sums);
  }
}

void TileBounds::make_change_tables() {
  const std::vector<WindowTable>& tables = tables_.front();
  for (std::size_t reading = changes_.size(); reading < tables.size(); ++reading) {
    changes_.push_back(change_table(reading == 0 ? nullptr : &tables[reading], tables.front()));
  }
}

void TileBounds::add_changes(const KnownElements& changed, const WindowPlaces& placed, int first_x,
                             int first_y, std::uint32_t* sums, int batches) const {
  std::uint32_t added[most_strip * batch_tiles] = {};
  std::uint32_t offsets = 0;
  for (const ReadingRun& run : changed.runs) {
    const ChangeTable& to = change(run.reading);
    add_penalties(placed, run, to.table, first_x, first_y, batches, added);
    offsets += static_cast<std::uint32_t>(run.end - run.begin) * to.offset;
  }
  for (int i = 0; i < batches * batch_tiles; ++i) {
    sums[i] += added[i] - offsets;  // modulo 2^32, which the result is within
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
  for (const ChangeTable& change : changes_) {
    bytes += change.table.bytes();
  }
  return bytes;
}

}  // namespace palpate
