#pragma once

#include <cstdint>

#include "gpu/context.hpp"

namespace palpate {

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

/// How sum_marginals covers (x, y) indices, in pairs, and thetas.
struct MarginalSizes {
  std::uint32_t lanes = 0;           ///< of a workgroup
  std::uint32_t side_by_side = 0;    ///< lanes that read neighbouring pairs; divides `lanes`
  std::uint32_t pairs_per_lane = 0;  ///< at most 16, which a lane holds in registers
  std::uint32_t thetas = 0;          ///< of a workgroup, at most `lanes`

  /// (x, y) indices of one workgroup.
  std::uint32_t plane() const { return 2 * lanes * pairs_per_lane; }
};

MarginalSizes marginal_sizes(const gpu::Limits& limits, std::int64_t plane, std::int64_t thetas);

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

}  // namespace palpate
