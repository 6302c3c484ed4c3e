#include "estimation/bounded/tables/tile_levels.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "estimation/bounded/tables/window_table.hpp"

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

/// Tiles of single bins where these are sparse and few, and their squares about as large as a cell.
std::optional<TileSize> single_bins(const PoseLattice& lattice, double least_cell_mm,
                                    std::size_t maps) {
  const double x_cells = lattice.x_mm.step() / least_cell_mm;
  const double y_cells = lattice.y_mm.step() / least_cell_mm;
  const double bins = static_cast<double>(lattice.x_mm.count) * lattice.y_mm.count *
                      lattice.theta_rad.count * static_cast<double>(maps);
  if (std::min(x_cells, y_cells) < sparse_cells || bins > most_single_bins) {
    return {};
  }
  TileSize size{.side = 2, .single_bin = true};
  while (size.side < most_side && x_cells * y_cells > size.side * size.side) {
    size.side *= 2;
  }
  return size;
}

TileAxis axis_of_bins(const Axis& axis) {
  TileAxis tiles{.first_mm = axis.centre(0), .side_mm = axis.step(), .first_bin = {}};
  const int batches = (axis.count - 1) / batch_side + 1;
  for (int tile = 0; tile <= batch_side * batches; ++tile) {
    tiles.first_bin.push_back(std::min(tile, axis.count));
  }
  return tiles;
}

TileAxis tile_axis(const Axis& axis, double side_mm) {
  TileAxis tiles{.first_mm = axis.centre(0), .side_mm = side_mm, .first_bin = {}};
  const double step = axis.step();
  // Tiles of all levels that begin at one place agree on the first bin: the product is exact alike,
  // for sides differ by powers of two.
  const auto first_bin = [&](int tile) {
    const double begin_mm = tile * side_mm;
    const double first = begin_mm == 0.0 ? 0.0 : std::ceil(begin_mm / step);
    return static_cast<int>(std::min<double>(first, axis.count));
  };
  // A whole number of batches, which ends where no bin is left by the same rounding: a tile with
  // bins then has all of its parts.
  const double extent_mm = step * (axis.count - 1);
  auto batches = static_cast<int>(std::floor(extent_mm / (batch_side * side_mm))) + 1;
  while (first_bin(batch_side * batches) < axis.count) {
    ++batches;
  }
  const int count = batch_side * batches;
  tiles.first_bin.reserve(static_cast<std::size_t>(count) + 1);
  for (int tile = 0; tile < count; ++tile) {
    tiles.first_bin.push_back(first_bin(tile));
  }
  tiles.first_bin.push_back(axis.count);
  return tiles;
}

}  // namespace

std::vector<TileSize> tile_sizes(const PoseLattice& lattice, double least_cell_mm,
                                 std::size_t maps) {
  if (const std::optional<TileSize> size = single_bins(lattice, least_cell_mm, maps)) {
    return {*size};
  }
  const auto tiles = [&](const TileSize& size) {
    const double side_mm = size.cells() * least_cell_mm;
    const auto count = [&](const Axis& axis) {
      return std::ceil((axis.upper - axis.lower) / side_mm) + 1.0;
    };
    return count(lattice.x_mm) * count(lattice.y_mm) * lattice.theta_rad.count *
           static_cast<double>(maps);
  };
  std::vector<TileSize> sizes{{.side = 8}, {.side = 2}, {.parts = 2, .side = 1}};
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
    sizes.insert(sizes.begin(), {.merged = 4 * sizes.front().merged, .side = 8});
  }
  return sizes;
}

glm::dvec2 square_mm(const TileSize& size, const PoseLattice& lattice, double cell_mm) {
  return size.single_bin
             ? glm::dvec2(lattice.x_mm.step(), lattice.y_mm.step()) / static_cast<double>(size.side)
             : glm::dvec2(size.square_cells() * cell_mm);
}

std::vector<TileLevel> tile_levels(const PoseLattice& lattice, double cell_mm,
                                   const std::vector<TileSize>& sizes) {
  std::vector<TileLevel> levels;
  for (const TileSize& size : sizes) {
    const double side_mm = size.cells() * cell_mm;
    const auto along = [&](const Axis& axis) {
      return size.single_bin ? axis_of_bins(axis) : tile_axis(axis, side_mm);
    };
    levels.push_back({.size = size,
                      .square_mm = square_mm(size, lattice, cell_mm),
                      .x = along(lattice.x_mm),
                      .y = along(lattice.y_mm)});
  }
  return levels;
}

}  // namespace palpate
