#include "estimation/bounded/search_memory.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "estimation/bounded/displaced/undisplaced_bins.hpp"
#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "estimation/bounded/search/leaves.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "estimation/bounded/tables/window_table.hpp"
#include "estimation/displacement_weights.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Bins that the parts of one tile may hold: they are evaluated together.
constexpr double most_family_bins = 1e7;
/// Bins of all objects that 64 bits number, with room for sums.
constexpr double most_bins = 4e18;

/// Tiles along an axis, as tile_levels() counts them.
double tiles_along(const Axis& axis, const TileSize& size, double side_mm) {
  const double batches =
      size.bins > 0 ? std::ceil(static_cast<double>(axis.count) / (batch_side * size.bins))
                    : std::floor(axis.step() * (axis.count - 1) / (batch_side * side_mm)) + 1.0;
  return batch_side * batches;
}

/// Most bins along an axis within this many mm.
double bins_within(const Axis& axis, double side_mm) {
  const double bins = axis.count > 1 ? std::floor(side_mm / axis.step()) + 1.0 : 1.0;
  return std::min<double>(bins, axis.count);
}

/// A window table's entries, as window_table() lays them out.
double table_bytes(const OccupancyGrid& map, const TileSize& size, const glm::dvec2& square_mm) {
  const auto windows = [&](int cells, double mm) {
    const double squares = std::ceil((cells + 1.0) / (mm / map.cell_mm));
    return 2.0 * WindowTable::margin + std::ceil(squares / size.side);
  };
  return windows(map.nx, square_mm.x) * windows(map.ny, square_mm.y) * batch_side * size.side *
         size.side * sizeof(std::uint16_t);
}

double node_bytes(const OccupancyGrid& map) {
  constexpr double border = 2.0 * MapPatches::border;
  return (map.nx + border) * (map.ny + border) * MapPatches::side * sizeof(float);
}

double bins_in_all(std::span<const Hypothesis> hypotheses, const PoseLattice& lattice) {
  return static_cast<double>(hypotheses.size()) * lattice.x_mm.count * lattice.y_mm.count *
         lattice.theta_rad.count;
}

}  // namespace

SearchMemory search_memory(std::span<const Hypothesis> hypotheses, const BoundedOptions& options) {
  const PoseLattice& lattice = options.lattice;
  const double thetas = lattice.theta_rad.count;
  const std::size_t readings =
      options.contact.table ? options.contact.table->levels() : std::size_t{2};
  double least_cell_mm = std::numeric_limits<double>::infinity();
  for (const Hypothesis& hypothesis : hypotheses) {
    least_cell_mm = std::min(least_cell_mm, hypothesis.compared().cell_mm);
  }
  const std::vector<TileSize> sizes =
      tile_sizes(lattice, least_cell_mm, hypotheses.size(), options.touch_sd);
  SearchMemory memory;
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.compared();
    memory.tables += node_bytes(map);
    const auto along = [&](const TileSize& size) {
      const double side_mm = size.cells() * map.cell_mm;
      return glm::dvec2(tiles_along(lattice.x_mm, size, side_mm),
                        tiles_along(lattice.y_mm, size, side_mm));
    };
    for (const TileSize& size : sizes) {
      memory.tables += static_cast<double>(readings) *
                       table_bytes(map, size, square_mm(size, lattice, map.cell_mm));
      memory.tiles += sizeof(int) * (along(size).x + along(size).y);
    }
    const double largest_tiles = thetas * along(sizes.front()).x * along(sizes.front()).y;
    memory.tiles += (sizeof(std::int32_t) + sizeof(Tile)) * largest_tiles;
    const TileSize& smallest = sizes.back();
    const double family_mm = batch_side * smallest.cells() * map.cell_mm;
    const auto in_family = [&](const Axis& axis) {
      return smallest.bins > 0 ? std::min<double>(axis.count, batch_side * smallest.bins)
                               : bins_within(axis, family_mm);
    };
    memory.largest_family =
        std::max(memory.largest_family, in_family(lattice.x_mm) * in_family(lattice.y_mm));
  }
  // A cosine and a sine; and of every object the tiles that see the map, and the best of them.
  memory.thetas = thetas * (sizeof(glm::dvec2) + static_cast<double>(hypotheses.size()) *
                                                     (sizeof(TileRange) + sizeof(Tile)));
  if (options.none_weight) {
    // What the mean of a touch keeps of every plane.
    constexpr double plane_bytes = 128.0;
    memory.thetas += thetas * static_cast<double>(hypotheses.size()) * plane_bytes;
    if (!options.touch_sd.none()) {
      // And of every theta, the places to which turns move its bins.
      const int steps = DisplacementWeights(lattice, options.touch_sd).theta_steps();
      memory.thetas += thetas * (2.0 * steps + 1.0) * 2.0 * sizeof(Tap);
    }
  }
  // The last family of a batch may exceed the batch by all of its bins.
  // Each bin's value as it is evaluated and kept.
  constexpr double bytes_per_bin = 2 * sizeof(double);
  memory.leaves =
      bytes_per_bin * std::min(static_cast<double>(largest_batch) + memory.largest_family,
                               bins_in_all(hypotheses, lattice));
  if (!options.touch_sd.none()) {
    // Every plane's mean, and its neighbours' sums; and of all bins, what is kept of them.
    memory.means = 2.0 * sizeof(double) * bins_in_all(hypotheses.first(1), lattice) +
                   static_cast<double>(UndisplacedBins::most_bytes);
  }
  return memory;
}

std::string why_no_room(std::span<const Hypothesis> hypotheses, const BoundedOptions& options,
                        std::uint64_t limit_bytes) {
  const PoseLattice& lattice = options.lattice;
  const std::string what =
      fmt::format("lattice: bounds of {} objects x {} x {} x {} bins", hypotheses.size(),
                  lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count);
  if (bins_in_all(hypotheses, lattice) > most_bins) {
    return fmt::format("{} are too many to number; use fewer bins", what);
  }
  const SearchMemory memory = search_memory(hypotheses, options);
  if (memory.largest_family > most_family_bins) {
    return fmt::format(
        "{}: {:.0f} bins within two cells of a map are more than a search evaluates together, "
        "{:.0f}; use fewer bins along x and y",
        what, memory.largest_family, most_family_bins);
  }
  if (memory.total() <= static_cast<double>(limit_bytes)) {
    return "";
  }
  struct Part {
    double bytes;
    const char* remedy;
  };
  const std::array<Part, 5> parts{
      {{memory.tables, "use fewer maps, maps of fewer cells, or a narrower region"},
       {memory.tiles, "use fewer thetas or maps, or narrow the region"},
       {memory.thetas, "use fewer thetas or maps"},
       {memory.leaves, "use fewer bins along x and y"},
       {memory.means, "use fewer bins"}}};
  const Part& largest = *std::max_element(
      parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.bytes < b.bytes; });
  constexpr double mib = 1 << 20;
  return fmt::format(
      "{} need {:.0f} MiB of the host's memory, a quarter of which are {:.0f} MiB; {}", what,
      std::ceil(memory.total() / mib), std::floor(static_cast<double>(limit_bytes) / mib),
      largest.remedy);
}

std::uint64_t memory_for_search() {
  const long pages = ::sysconf(_SC_PHYS_PAGES);
  const long page_bytes = ::sysconf(_SC_PAGESIZE);
  constexpr std::uint64_t where_unknown = std::uint64_t{1} << 30;
  return pages > 0 && page_bytes > 0
             ? static_cast<std::uint64_t>(pages) / 4 * static_cast<std::uint64_t>(page_bytes)
             : where_unknown;
}

}  // namespace palpate
