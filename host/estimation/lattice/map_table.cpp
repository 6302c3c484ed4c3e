#include "estimation/lattice/map_table.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "estimation/bordered_map.hpp"
#include "palpate/error.hpp"
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

std::uint64_t MapTable::bytes_needed(const MapGroup& group, const PoseLattice& lattice) {
  return gpu::allocated(BorderedMaps::bytes_needed(group.kind.access, group.cells)) +
         gpu::allocated(group.objects.size() * axis_bins(lattice) * sizeof(shaders::Split)) +
         gpu::allocated(group.objects.size() * sizeof(shaders::ObjectPlace));
}

MapTable::MapTable(gpu::Context& context, gpu::CommandStream& stream, const MapGroup& group,
                   std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
                   std::span<const std::uint32_t> first_bins, double prior,
                   const ContactTable& contact)
    : maps_(context, group.kind.access, group.cells,
            fmt::format("map '{}'", hypotheses[group.objects.front()].map.label)) {
  std::vector<shaders::Split> axes;
  std::vector<shaders::ObjectPlace> places;
  for (const std::size_t object : group.objects) {
    const OccupancyGrid& map = hypotheses[object].compared();
    places.push_back({.first_node = maps_.add(stream, map, prior),
                      .map_width = bordered(map.nx),
                      .map_height = bordered(map.ny),
                      .first_axis = static_cast<shaders::uint>(axes.size()),
                      .first_bin = first_bins[object],
                      .first_table_node = contact.first_node(object)});
    const std::vector<shaders::Split> own_axes = axes_in_cells(map, lattice);
    axes.insert(axes.end(), own_axes.begin(), own_axes.end());
  }
  axes_ = stream.uploaded(axes, "the lattice's axes");
  places_ = stream.uploaded(places, "the objects' places");
}

}  // namespace palpate
