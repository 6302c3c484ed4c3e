#include "estimation/bounded/tables/tile_bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "estimation/parallel_for.hpp"

namespace palpate {

namespace {

/// Largest tiles, of all maps, whose penalties are kept between touches, 4 bytes each.
constexpr double most_largest_tiles = 4e6;
constexpr double largest_cells = 1e6;  ///< side of a tile: larger than any map with its border

/// Bins of a tile that take no longer to evaluate than its 4 x 4 parts to bound.
constexpr double few_bins = 3.0;

/// Steps, in cells of the finest map, from which on tiles are single bins, and most bins of all
/// maps.
constexpr double sparse_cells = 2.0;
constexpr double most_single_bins = 8e6;
/// Most squares along a single bin's side: tables grow with their number.
constexpr int most_side = 16;

/// Tiles, of all maps, up to which larger ones would save less than they cost where touches are
/// displaced; and the side from which on larger tiles leave out too little, in standard deviations.
constexpr double enough_tiles = 3e5;
constexpr double widest_sd = 2.0;
/// Side of the smallest tiles where touches are displaced, in standard deviations and in cells.
constexpr double smallest_sd = 0.6;
constexpr double smallest_cells = 0.5;

/// Squares along the side of a tile of whole bins, about as large as a cell.
int side_of_bins(double x_cells, double y_cells) {
  int side = 2;
  while (side < most_side && x_cells * y_cells > side * side) {
    side *= 2;
  }
  return side;
}

double step_mm(const Axis& axis) { return axis.count > 1 ? axis.step() : 0.0; }

/// Tiles of whole bins, where touches are displaced.
std::vector<TileSize> sizes_in_bins(const PoseLattice& lattice, double least_cell_mm,
                                    std::size_t maps, const DisplacementSd& touch_sd) {
  const double step = std::max(step_mm(lattice.x_mm), step_mm(lattice.y_mm));
  const auto size_of = [&](int bins) {
    const auto cells = [&](const Axis& axis) {
      return std::max(bins * step_mm(axis) / least_cell_mm, 1.0);
    };
    return TileSize{.side = side_of_bins(cells(lattice.x_mm), cells(lattice.y_mm)), .bins = bins};
  };
  const double smallest_mm = std::max(smallest_sd * touch_sd.mm, smallest_cells * least_cell_mm);
  int bins = 1;
  while (2 * bins * step <= smallest_mm &&
         bins < std::max(lattice.x_mm.count, lattice.y_mm.count)) {
    bins *= 2;
  }
  std::vector<TileSize> sizes{size_of(bins)};
  const double widest_mm = widest_sd * std::max(touch_sd.mm, least_cell_mm);
  const auto tiles = [&] {
    const auto along = [&](const Axis& axis) { return (axis.count - 1) / bins + 1; };
    return static_cast<double>(along(lattice.x_mm)) * along(lattice.y_mm) *
           lattice.theta_rad.count * static_cast<double>(maps);
  };
  while ((tiles() > enough_tiles && bins * step < widest_mm) || tiles() > most_largest_tiles) {
    if (bins >= std::max(lattice.x_mm.count, lattice.y_mm.count)) {
      break;
    }
    bins *= batch_side;
    sizes.insert(sizes.begin(), size_of(bins));
  }
  return sizes;
}

TileAxis tile_axis(const Axis& axis, const TileSize& size, double side_mm) {
  TileAxis tiles{.first_mm = axis.centre(0), .side_mm = side_mm, .first_bin = {}};
  // Tiles of all levels that begin at one place agree on the first bin: the product is exact alike,
  // for sides differ by powers of two.
  const auto first_bin = [&](int tile) {
    const double begin_mm = tile * side_mm;
    const double first = size.bins > 0     ? static_cast<double>(tile) * size.bins
                         : begin_mm == 0.0 ? 0.0
                                           : std::ceil(begin_mm / axis.step());
    return static_cast<int>(std::min<double>(first, axis.count));
  };
  // A whole number of batches, which ends where no bin is left by the same rounding: a tile with
  // bins then has all of its parts.
  auto count = batch_side * static_cast<int>(batches_along(axis, size, side_mm));
  while (first_bin(count) < axis.count) {
    count += batch_side;
  }
  tiles.first_bin.reserve(static_cast<std::size_t>(count) + 1);
  for (int tile = 0; tile <= count; ++tile) {
    tiles.first_bin.push_back(first_bin(tile));
  }
  return tiles;
}

}  // namespace

std::vector<TileSize> tile_sizes(const PoseLattice& lattice, double least_cell_mm, std::size_t maps,
                                 const DisplacementSd& touch_sd) {
  if (!touch_sd.none()) {
    return sizes_in_bins(lattice, least_cell_mm, maps, touch_sd);
  }
  const double x_cells = lattice.x_mm.step() / least_cell_mm;
  const double y_cells = lattice.y_mm.step() / least_cell_mm;
  const double all_bins = static_cast<double>(lattice.x_mm.count) * lattice.y_mm.count *
                          lattice.theta_rad.count * static_cast<double>(maps);
  if (std::min(x_cells, y_cells) >= sparse_cells && all_bins <= most_single_bins) {
    // Single bins are sparse and few; their squares are about as large as a cell.
    return {{.side = side_of_bins(x_cells, y_cells), .bins = 1}};
  }
  const auto tiles = [&](const TileSize& size) {
    const double side_mm = size.cells() * least_cell_mm;
    const auto count = [&](const Axis& axis) {
      return std::ceil((axis.upper - axis.lower) / side_mm) + 1.0;
    };
    return count(lattice.x_mm) * count(lattice.y_mm) * lattice.theta_rad.count *
           static_cast<double>(maps);
  };
  std::vector<TileSize> sizes{{.side = 8}, {.side = 2}, {.square_cells = 0.5, .side = 1}};
  const auto bins = [&](const TileSize& size) {
    const auto along = [&](const Axis& axis) {
      return std::clamp(size.cells() * least_cell_mm / axis.step(), 1.0,
                        static_cast<double>(axis.count));
    };
    return along(lattice.x_mm) * along(lattice.y_mm);
  };
  while (sizes.size() > 1 && bins(sizes[sizes.size() - 2]) < few_bins) {
    sizes.pop_back();
  }
  while (tiles(sizes.front()) > most_largest_tiles && sizes.front().cells() < largest_cells) {
    // As many squares, each of more cells: tables shrink, and windows widen by little.
    sizes.insert(sizes.begin(), {.square_cells = 4.0 * sizes.front().square_cells, .side = 8});
  }
  return sizes;
}

glm::dvec2 square_mm(const TileSize& size, const PoseLattice& lattice, double cell_mm) {
  if (size.bins == 0) {
    return glm::dvec2(size.square_cells * cell_mm);
  }
  const auto along = [&](const Axis& axis) {
    // The only bin of an axis stays at its place.
    return (axis.count > 1 ? size.bins * axis.step() : 2.0 * cell_mm) / size.side;
  };
  return {along(lattice.x_mm), along(lattice.y_mm)};
}

double batches_along(const Axis& axis, const TileSize& size, double side_mm) {
  return size.bins > 0 ? std::ceil(static_cast<double>(axis.count) / (batch_side * size.bins))
                       : std::floor(axis.step() * (axis.count - 1) / (batch_side * side_mm)) + 1.0;
}

std::vector<TileLevel> tile_levels(const PoseLattice& lattice, double cell_mm,
                                   const std::vector<TileSize>& sizes) {
  std::vector<TileLevel> levels;
  for (const TileSize& size : sizes) {
    const glm::dvec2 square = square_mm(size, lattice, cell_mm);
    levels.push_back({.size = size,
                      .square_mm = square,
                      .x = tile_axis(lattice.x_mm, size, size.side * square.x),
                      .y = tile_axis(lattice.y_mm, size, size.side * square.y)});
  }
  return levels;
}

TileBounds::TileBounds(const OccupancyGrid& map, const ContactModel& contact, std::size_t object,
                       const PoseLattice& lattice, const std::vector<TileSize>& sizes)
    : levels_(tile_levels(lattice, map.cell_mm, sizes)),
      // Square 0 lies between the first node and the prior's node before it.
      corner_mm_(glm::dvec2(lattice.x_mm.centre(0), lattice.y_mm.centre(0)) - map.origin_mm +
                 map.cell_mm) {
  const double prior_log_odds = log_odds_from_probability(*contact.prior);
  // Levels may divide the map alike.
  const auto as_before = [&](std::size_t level) {
    return level > 0 && levels_[level].square_mm == levels_[level - 1].square_mm;
  };
  std::vector<MapSquares> squares;  // [level]
  for (std::size_t level = 0; level < levels_.size(); ++level) {
    squares.push_back(as_before(level)
                          ? MapSquares()
                          : map_squares(map, prior_log_odds, levels_[level].square_mm));
  }
  const std::size_t readings = contact.table ? contact.table->levels() : 2;
  tables_.assign(levels_.size(), std::vector<WindowTable>(readings));
  parallel_for(readings, [&](std::size_t reading) {
    SquarePenalties penalties;
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      const TileSize& size = levels_[level].size;
      if (!as_before(level)) {
        penalties =
            square_penalties(squares[level], contact, static_cast<Reading>(reading), object);
      }
      tables_[level][reading] = window_table(penalties, size.side, size.window());
    }
  });
}

void TileBounds::place(std::size_t level, const glm::dvec2& turn, const KnownElements& elements,
                       WindowPlaces& placed) const {
  place_windows(elements,
                {.turn = turn, .corner_mm = corner_mm_, .square_mm = levels_[level].square_mm},
                tables_[level].front(), placed);
}

void TileBounds::add(std::size_t level, const KnownElements& elements, const WindowPlaces& placed,
                     int first_x, int first_y, std::uint32_t* sums) const {
  std::array<TableRun, most_reading_levels + 1> runs;
  std::size_t count = 0;
  for (const ReadingRun& run : elements.runs) {
    runs.at(count++) = {&table(level, run.reading), run.begin, run.end};
  }
  add_penalties(placed, std::span(runs).first(count), first_x, first_y, sums);
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
      bytes += table.entries.capacity() * sizeof(std::uint16_t);
    }
  }
  return bytes;
}

}  // namespace palpate
