#include "estimation/lattice/map_table.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <glm/vec2.hpp>

#include "estimation/kernel_sizes.hpp"
#include "palpate/error.hpp"
#include "shaders/accumulate_likelihood.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

int bordered(int cells) { return cells + 2 * shaders::MAP_BORDER; }

/// How kernels read the map. Throws Error where the device has no way.
gpu::Access access_of(const gpu::Context& context, const OccupancyGrid& map) {
  const gpu::Limits& limits = context.limits();
  if (const auto access = map_access(limits, bordered_cells(map))) {
    return *access;
  }
  throw Error(
      Fault::input,
      fmt::format("map '{}': {} x {} cells exceed the {} that kernels of device '{}' read in one "
                  "buffer; build it with larger cells",
                  map.label, map.nx, map.ny, most_map_cells(limits), context.name()));
}

std::size_t axis_bins(const PoseLattice& lattice) {
  return static_cast<std::size_t>(lattice.x_mm.count) + lattice.y_mm.count;
}

using gpu::Access;

constexpr std::uint32_t longest_run = 8;
constexpr std::uint32_t longest_edge = 5;

/// Neighbouring bins that an invocation takes, which together span at most `cells` cells; of a run,
/// 0.
struct Tile {
  std::uint32_t cells = 0;
  std::uint32_t x = 0;
  std::uint32_t y = 0;

  std::uint32_t bins() const { return x * y; }
};

std::uint32_t bins_within(std::uint32_t cells, double step_cells, int count) {
  const double most = 1.0 + std::floor(cells / std::max(step_cells, 1e-9) * (1.0 + 1e-12));
  return static_cast<std::uint32_t>(
      std::min({most, static_cast<double>(count), static_cast<double>(longest_edge)}));
}

Tile tile_within(std::uint32_t cells, const glm::dvec2& step_cells, const PoseLattice& lattice,
                 std::uint32_t most_bins) {
  Tile tile{.cells = cells,
            .x = bins_within(cells, step_cells.x, lattice.x_mm.count),
            .y = bins_within(cells, step_cells.y, lattice.y_mm.count)};
  while (tile.bins() > most_bins) {
    (tile.x > tile.y ? tile.x : tile.y) -= 1;
  }
  return tile;
}

/// Fewest bins with which a tile is faster than runs of bins. On a CPU device a run takes as long
/// as a tile of nine over two cells, measured. A GPU waits for fetches: a tile has four, a run one
/// a bin.
std::uint32_t least_bins(const gpu::Limits& limits) { return limits.cpu ? 10 : 5; }

/// The run length that covers a row with the fewest bins beyond its end, the longest of equals.
std::uint32_t run_for(std::uint32_t nx, std::uint32_t longest) {
  std::uint32_t best = 1;
  for (std::uint32_t run = 1; run <= std::min(nx, longest); ++run) {
    // Sharing the element's load is worth a little waste.
    const auto cost = [nx](std::uint32_t r) { return groups_of(nx, r) * (r + 1); };
    if (cost(run) <= cost(best)) {
      best = run;
    }
  }
  return best;
}

}  // namespace

std::vector<MapGroup> group_maps(const gpu::Context& context,
                                 std::span<const Hypothesis> hypotheses,
                                 const PoseLattice& lattice) {
  const gpu::Limits& limits = context.limits();
  const std::size_t most_places =
      std::min(limits.storage_range, limits.allocation) / sizeof(shaders::Split);
  const std::size_t most_objects = most_places / axis_bins(lattice);
  if (most_objects == 0) {
    const bool x = lattice.x_mm.count > lattice.y_mm.count;
    throw Error(Fault::input,
                fmt::format("bins {} = {}: device '{}' takes at most {} of x and y together; use "
                            "fewer",
                            x ? "x" : "y", (x ? lattice.x_mm : lattice.y_mm).count, context.name(),
                            most_places));
  }
  std::vector<MapGroup> groups;
  for (std::size_t object = 0; object < hypotheses.size(); ++object) {
    const OccupancyGrid& map = hypotheses[object].compared();
    const MapKind kind{map.cell_mm, access_of(context, map)};
    const std::uint64_t cells = bordered_cells(map);
    const std::uint64_t most = most_map_cells(limits, kind.access);
    const auto group = std::find_if(groups.begin(), groups.end(), [&](const MapGroup& g) {
      return g.kind == kind && g.cells + cells <= most && g.objects.size() < most_objects;
    });
    if (group == groups.end()) {
      groups.push_back({kind, cells, {object}});
    } else {
      group->cells += cells;
      group->objects.push_back(object);
    }
  }
  return groups;
}

MapTable::MapTable(gpu::Context& context, gpu::CommandStream& stream, const MapGroup& group,
                   std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
                   std::span<const std::uint32_t> first_bins, double prior,
                   const ContactTable& contact)
    : maps(context, group.kind.access, group.cells,
           fmt::format("map '{}'", hypotheses[group.objects.front()].map.label)) {
  std::vector<shaders::Split> all_axes;
  std::vector<shaders::ObjectPlace> all_places;
  for (const std::size_t object : group.objects) {
    const OccupancyGrid& map = hypotheses[object].compared();
    all_places.push_back({.first_node = maps.add(stream, map, prior),
                          .map_width = bordered(map.nx),
                          .map_height = bordered(map.ny),
                          .first_axis = static_cast<shaders::uint>(all_axes.size()),
                          .first_bin = first_bins[object],
                          .first_table_node = contact.first_node(object)});
    const std::vector<shaders::Split> own_axes = axes_in_cells(map, lattice);
    all_axes.insert(all_axes.end(), own_axes.begin(), own_axes.end());
  }
  axes = stream.uploaded(all_axes, "the lattice's axes");
  places = stream.uploaded(all_places, "the objects' places");
}

LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                           const MapKind& maps, const ContactModel& model) {
  const gpu::Limits& limits = context.limits();
  const glm::dvec2 step_cells = glm::dvec2(lattice.x_mm.step(), lattice.y_mm.step()) / maps.cell_mm;
  const std::uint32_t most_bins =
      most_bins_per_invocation(limits, lattice.bins() * static_cast<std::int64_t>(objects));
  Tile tile = tile_within(1, step_cells, lattice, most_bins);
  // Sixteen nodes in the place of nine cost a fifth more a bin, but are shared: measured, 5 x 5
  // bins over two cells take three quarters of the time of 3 x 3 over one, and as long as 4 x 4.
  if (const Tile wide = tile_within(2, step_cells, lattice, most_bins);
      wide.bins() >= 2 * tile.bins()) {
    tile = wide;
  }
  const bool tiled = tile.bins() >= least_bins(limits);
  if (!tiled) {
    const auto nx = static_cast<std::uint32_t>(lattice.x_mm.count);
    tile = {.cells = 0, .x = run_for(nx, std::min(longest_run, most_bins)), .y = 1};
  }
  const auto step_bits = [&](double step) {
    return std::bit_cast<std::uint32_t>(tiled ? static_cast<float>(step) : 0.0F);
  };
  std::vector<std::uint32_t> constants = contact_constants(limits, model);
  constants.insert(constants.end(), {maps.access == Access::table ? 1U : 0U, tile.x, tile.y,
                                     step_bits(step_cells.x), step_bits(step_cells.y), tile.cells});
  return {
      .kernel = gpu::Kernel(context, {.name = "accumulate_likelihood",
                                      .spirv = shaders::accumulate_likelihood,
                                      .bindings = {Access::table, Access::table, Access::table,
                                                   Access::table, Access::storage, Access::storage,
                                                   Access::storage, Access::storage},
                                      .push_bytes = sizeof(shaders::LikelihoodPush),
                                      .constants = constants}),
      .bins_x = tile.x,
      .bins_y = tile.y,
      .description =
          tiled
              ? fmt::format("register tiles of {} x {} bins over {} of a side: the lattice's step "
                            "is {:.3g} x {:.3g} of a map cell",
                            tile.x, tile.y, tile.cells == 1 ? "one cell" : "two cells",
                            step_cells.x, step_cells.y)
              : fmt::format("runs of {} bins: at a lattice step of {:.3g} x {:.3g} map cells "
                            "fewer bins than a tile needs lie side by side{}",
                            tile.x, step_cells.x, step_cells.y,
                            limits.cpu ? "" : ", or tiles leave the GPU idle")};
}

}  // namespace palpate
