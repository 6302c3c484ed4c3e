#include "estimation/lattice/slab.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "estimation/kernel_sizes.hpp"
#include "estimation/two_float.hpp"
#include "palpate/error.hpp"

namespace palpate {

shaders::PlanesPush planes_of(const SlabExtent& slab, int thetas) {
  return {.nx = slab.nx,
          .ny = slab.row_count,
          .thetas = slab.theta_count,
          .theta_first = slab.theta_first,
          .all_thetas = static_cast<shaders::uint>(thetas),
          .object_first = slab.object_first,
          .stride = static_cast<shaders::uint>(slab.stride())};
}

std::vector<SlabExtent> cut_into_slabs(const gpu::Context& context, const PoseLattice& lattice,
                                       std::size_t objects, std::uint32_t reduction_bins) {
  const gpu::Limits& limits = context.limits();
  const auto binding_bins = static_cast<std::int64_t>(
      std::min({limits.storage_range / sizeof(TwoFloat), limits.allocation / sizeof(TwoFloat),
                VkDeviceSize{limits.table_texels} * 2,
                VkDeviceSize{limits.group_count[0]} * reduction_bins}) /
      2 * 2);
  // However few bins an invocation takes, a plane's rows must fit one dispatch.
  const std::int64_t plane_bins =
      std::min(binding_bins, std::int64_t{limits.group_count[0]} * independent_lanes(limits));
  const std::int64_t rows =
      std::min<std::int64_t>(plane_bins / lattice.x_mm.count, lattice.y_mm.count);
  if (rows == 0) {
    throw Error(Fault::input, fmt::format("bins x = {}: device '{}' takes at most {}; use fewer",
                                          lattice.x_mm.count, context.name(), plane_bins));
  }
  const std::int64_t thetas =
      rows < lattice.y_mm.count
          ? 1
          : std::min({binding_bins / lattice.plane(),
                      std::int64_t{std::min(limits.group_count[1], limits.group_count[2])},
                      std::int64_t{lattice.theta_rad.count}});
  SlabExtent extent{.theta_count = static_cast<std::uint32_t>(thetas),
                    .row_count = static_cast<std::uint32_t>(rows),
                    .nx = static_cast<std::uint32_t>(lattice.x_mm.count)};
  std::size_t together = 1;  // objects of a slab
  if (extent.bins() == lattice.bins()) {
    together = static_cast<std::size_t>(std::clamp<std::int64_t>(
        binding_bins / extent.stride(), 1, std::int64_t{limits.group_count[1]}));
  }
  std::vector<SlabExtent> slabs;
  for (std::size_t object = 0; object < objects; object += together) {
    extent.object_first = static_cast<std::uint32_t>(object);
    extent.object_count = static_cast<std::uint32_t>(std::min(together, objects - object));
    for (std::int64_t theta = 0; theta < lattice.theta_rad.count; theta += thetas) {
      extent.theta_first = static_cast<std::uint32_t>(theta);
      extent.theta_count =
          static_cast<std::uint32_t>(std::min(thetas, lattice.theta_rad.count - theta));
      for (std::int64_t row = 0; row < lattice.y_mm.count; row += rows) {
        extent.row_first = static_cast<std::uint32_t>(row);
        extent.row_count = static_cast<std::uint32_t>(std::min(rows, lattice.y_mm.count - row));
        slabs.push_back(extent);
      }
    }
  }
  return slabs;
}

}  // namespace palpate
