#include "estimation/bounded/search_memory.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <fmt/format.h>

#include "estimation/bounded/displaced/undisplaced_bins.hpp"
#include "estimation/bounded/leaves/bin_kernel.hpp"
#include "estimation/bounded/search/leaves.hpp"
#include "estimation/bounded/search/search_space.hpp"
#include "estimation/bounded/tables/tile_bounds.hpp"
#include "estimation/bounded/tables/window_table.hpp"

namespace palpate {

namespace {

/// Bins that the parts of one tile may hold: they are evaluated together.
constexpr double most_family_bins = 1e7;
/// Bins of all objects that 64 bits number, with room for sums.
constexpr double most_bins = 4e18;

/// Most bins along an axis within a batch of tiles.
double bins_in_batch(const Axis& axis, const TileSize& size, double cell_mm) {
  const double bins = size.bins > 0
                          ? batch_side * size.bins
                          : std::floor(batch_side * size.cells() * cell_mm / axis.step()) + 1.0;
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

}  // namespace

double bins_in_all(std::size_t objects, const PoseLattice& lattice) {
  return static_cast<double>(objects) * lattice.x_mm.count * lattice.y_mm.count *
         lattice.theta_rad.count;
}

SearchMemory search_memory(std::span<const Hypothesis> hypotheses, const BoundedOptions& options) {
  const PoseLattice& lattice = options.lattice;
  const double thetas = lattice.theta_rad.count;
  const std::size_t readings = options.contact.table ? options.contact.table->levels() : 2;
  const std::vector<TileSize> sizes = tile_sizes(hypotheses, options);
  // Of every object and theta, the tiles that see the map and the best of them; and what the mean
  // of a touch keeps.
  const double plane_bytes = sizeof(TileRange) + sizeof(Tile) + (options.none_weight ? 128.0 : 0.0);
  SearchMemory memory{.tiles = thetas * sizeof(glm::dvec2)};  // cosines and sines
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.compared();
    memory.tables += node_bytes(map);
    for (const TileSize& size : sizes) {
      const glm::dvec2 square = square_mm(size, lattice, map.cell_mm);
      const double x_tiles = batch_side * batches_along(lattice.x_mm, size, size.side * square.x);
      const double y_tiles = batch_side * batches_along(lattice.y_mm, size, size.side * square.y);
      memory.tables += static_cast<double>(readings) * table_bytes(map, size, square);
      memory.tiles += sizeof(int) * (x_tiles + y_tiles);
      if (&size == &sizes.front()) {
        constexpr double tile_bytes = sizeof(std::int32_t) + sizeof(Tile);  // its sum, its place
        memory.tiles += thetas * (x_tiles * y_tiles * tile_bytes + plane_bytes);
      }
    }
    memory.largest_family =
        std::max(memory.largest_family, bins_in_batch(lattice.x_mm, sizes.back(), map.cell_mm) *
                                            bins_in_batch(lattice.y_mm, sizes.back(), map.cell_mm));
  }
  // The last family of a batch may exceed the batch by all of its bins. Each bin's value stands
  // there as it is evaluated and as it is kept.
  memory.bins = 2.0 * sizeof(double) *
                std::min(static_cast<double>(largest_batch) + memory.largest_family,
                         bins_in_all(hypotheses.size(), lattice));
  if (!options.touch_sd.none()) {
    // Every plane's mean, and its neighbours' sums; and of all bins, what is kept of them.
    memory.bins += 2.0 * sizeof(double) * bins_in_all(1, lattice) +
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
  if (bins_in_all(hypotheses.size(), lattice) > most_bins) {
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
  const char* const remedy = memory.tables >= std::max(memory.tiles, memory.bins)
                                 ? "use fewer maps, maps of fewer cells, or a narrower region"
                             : memory.tiles >= memory.bins
                                 ? "use fewer thetas or maps, or narrow the region"
                                 : "use fewer bins";
  constexpr double mib = 1 << 20;
  return fmt::format(
      "{} need {:.0f} MiB of the host's memory, a quarter of which are {:.0f} MiB; {}", what,
      std::ceil(memory.total() / mib), std::floor(static_cast<double>(limit_bytes) / mib), remedy);
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
