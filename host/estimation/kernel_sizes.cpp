#include "estimation/kernel_sizes.hpp"

#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Workgroups of a reduction that keep every core busy, before they grow in the place of their
/// number: measured on a CPU device of two cores, where 16 of them took a fifth longer; several per
/// unit of a GPU that has a hundred.
std::int64_t groups_that_fill(const gpu::Limits& limits) { return limits.cpu ? 4 : 1024; }

/// The largest power of two up to `wanted` lanes that the device runs in one workgroup.
std::uint32_t lanes_up_to(const gpu::Limits& limits, std::uint32_t wanted) {
  return std::bit_floor(
      std::max(1U, std::min({wanted, limits.group_invocations, limits.group_size[0]})));
}

/// A subgroup reads one stretch of memory: a CPU runs one ahead of the others, and for a GPU that
/// is a whole number of cache lines.
std::uint32_t side_by_side(const gpu::Limits& limits, std::uint32_t lanes) {
  return std::min(std::bit_floor(std::max(limits.subgroup, 1U)), lanes);
}

}  // namespace

ReductionSizes reduction_sizes(const gpu::Limits& limits, std::int64_t bins) {
  // A CPU runs the lanes of a workgroup one vector after the other, so that more of them gain
  // nothing; on a GPU they hide each other's wait for memory.
  const std::uint32_t wanted = limits.cpu ? 64 : 256;
  // Each lane shares its maximum, the bin and the sum in the end.
  constexpr std::uint32_t shared_per_lane = 16;
  const std::uint32_t lanes =
      lanes_up_to(limits, std::min(wanted, limits.shared_bytes / shared_per_lane));
  // Long stretches amortise the tree of the end. On a GPU 32 texels do, 512 bytes of a lane.
  const std::int64_t most = limits.cpu ? 128 : 32;
  constexpr std::int64_t batch = shaders::REDUCE_BATCH;
  const std::int64_t texels = bins / 2 / (lanes * groups_that_fill(limits));
  return {.lanes = lanes,
          .side_by_side = side_by_side(limits, lanes),
          .texels_per_lane =
              static_cast<std::uint32_t>(std::clamp(texels / batch * batch, batch, most))};
}

std::uint32_t independent_lanes(const gpu::Limits& limits) {
  // Small workgroups spread a small lattice over all units, and 64 lanes are whole subgroups of
  // nearly every device.
  return lanes_up_to(limits, std::max(64U, limits.subgroup));
}

std::uint32_t block_cells(const gpu::Limits& limits) {
  // The larger the block, the more cells share an exponential; but a tile must be at least one
  // whole subgroup.
  std::uint32_t block = 4;
  const auto invocations = [](std::uint32_t cells) {
    const std::uint32_t edge = shaders::TILE_CELLS / cells;
    return edge * edge;
  };
  while (block > 1 && invocations(block) < limits.subgroup &&
         invocations(block / 2) <= limits.group_invocations) {
    block /= 2;
  }
  return block;
}

std::uint32_t most_bins_per_invocation(const gpu::Limits& limits, std::int64_t bins) {
  // A CPU device is full at once. 25 bins are what an invocation holds in registers.
  constexpr std::int64_t largest = 25;
  constexpr std::int64_t invocations_that_fill_a_gpu = 1 << 16;
  return static_cast<std::uint32_t>(
      limits.cpu ? largest
                 : std::clamp<std::int64_t>(bins / invocations_that_fill_a_gpu, 1, largest));
}

double work_per_run(const gpu::Limits& limits) {
  // About half a second on a CPU device and on a small GPU, so that progress shows; watchdogs of
  // desktop GPUs allow two.
  return limits.cpu ? 5e8 : 1e10;
}

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
