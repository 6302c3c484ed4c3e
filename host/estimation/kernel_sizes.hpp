#pragma once

#include <cstdint>
#include <vector>

#include "gpu/buffer.hpp"
#include "gpu/context.hpp"
#include "palpate/lattice.hpp"
#include "shaders/interface.h"

namespace palpate {

/// A number as two floats, high + low, as the kernels keep their long sums.
struct TwoFloat {
  float high = 0.0F;
  float low = 0.0F;
  double value() const { return static_cast<double>(high) + low; }
};

/// Workgroups that cover `count` things.
constexpr std::uint32_t groups_of(std::int64_t count, std::int64_t per_group) {
  return static_cast<std::uint32_t>((count + per_group - 1) / per_group);
}

// How the kernels divide their work, by the device's limits and the size of the problem. A CPU
// device has a few cores: it wants few, long-running workgroups, each of whose vectors walks
// through memory of its own. A GPU wants tens of thousands of invocations, in whole subgroups that
// read side by side. Sizes differ in rounding, so that equal bits hold for one device only.

/// How reduce_belief covers bins, two to a texel.
struct ReductionSizes {
  std::uint32_t lanes = 0;            ///< of a workgroup, a power of two
  std::uint32_t side_by_side = 0;     ///< lanes that read neighbouring texels; divides `lanes`
  std::uint32_t texels_per_lane = 0;  ///< a multiple of shaders::REDUCE_BATCH

  /// Bins of one workgroup.
  std::uint32_t bins() const { return 2 * lanes * texels_per_lane; }
};

ReductionSizes reduction_sizes(const gpu::Limits& limits, std::int64_t bins);

/// Workgroup of the kernels whose invocations share nothing: likelihoods and the sum of beliefs.
std::uint32_t independent_lanes(const gpu::Limits& limits);

/// Edge of the block of cells that an invocation of accumulate_evidence takes; divides
/// shaders::TILE_CELLS.
std::uint32_t block_cells(const gpu::Limits& limits);

/// Most bins that an invocation of a likelihood kernel may take so that a lattice of this many bins
/// still fills the device.
std::uint32_t most_bins_per_invocation(const gpu::Limits& limits, std::int64_t bins);

/// Bins times elements of one submission.
double work_per_run(const gpu::Limits& limits);

/// A part of a dense belief that fits one binding and one dispatch: all bins of several objects, or
/// a part of one object's bins. The part is the rows (indices along y) [row_first, row_first +
/// row_count) of `theta_count` planes from `theta_first`.
struct SlabExtent {
  std::uint32_t object_first = 0;
  std::uint32_t object_count = 1;
  std::uint32_t theta_first = 0;
  std::uint32_t theta_count = 0;
  std::uint32_t row_first = 0;
  std::uint32_t row_count = 0;
  std::uint32_t nx = 0;

  std::uint32_t plane() const { return row_count * nx; }
  /// Bins of one object.
  std::int64_t bins() const { return std::int64_t{theta_count} * plane(); }
  /// Bins from one object's first to the next object's first: even, since reductions read two bins
  /// per texel.
  std::int64_t stride() const { return (bins() + 1) / 2 * 2; }
  bool holds(std::size_t object) const { return object - object_first < object_count; }
  std::int64_t first_bin(std::size_t object) const {
    return static_cast<std::int64_t>(object - object_first) * stride();
  }
  /// Bytes of all objects, two floats per bin.
  VkDeviceSize bytes() const { return static_cast<VkDeviceSize>(object_count * stride()) * 8; }
};

/// A slab of whole planes as kernels see it.
/// @param thetas of the lattice
shaders::PlanesPush planes_of(const SlabExtent& slab, int thetas);

/// A slab's extent with its memory.
struct Slab : SlabExtent {
  gpu::Buffer log_likelihood;  ///< [object, theta, y, x], two floats each
};

/// Cuts the objects' bins into slabs, in the order of the objects and of the lattice. A slab holds
/// as many whole objects as fit a binding and a dispatch. Where one object is too large, a slab
/// holds some of its theta planes; where one plane is too large, some of its rows.
/// @param reduction_bins that one workgroup of a reduction covers
/// @throws Error where a single row is too large
std::vector<SlabExtent> cut_into_slabs(const gpu::Context& context, const PoseLattice& lattice,
                                       std::size_t objects, std::uint32_t reduction_bins);

}  // namespace palpate
