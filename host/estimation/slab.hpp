#pragma once

#include <cstdint>
#include <vector>

#include "buffer.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A part of an object's bins that fits one binding and one dispatch: of `theta_count` planes from
/// `theta_first` the rows (indices along y) [row_first, row_first + row_count).
struct SlabExtent {
  std::uint32_t theta_first = 0;
  std::uint32_t theta_count = 0;
  std::uint32_t row_first = 0;
  std::uint32_t row_count = 0;
  std::uint32_t nx = 0;

  std::uint32_t plane() const { return row_count * nx; }
  std::int64_t bins() const { return std::int64_t{theta_count} * plane(); }
  /// Of the bins, two floats each. Reductions read two bins a texel, so an odd number takes room
  /// for one more.
  VkDeviceSize bytes() const { return static_cast<VkDeviceSize>(bins() + 1) / 2 * 16; }
};

/// That part with its memory.
struct Slab : SlabExtent {
  gpu::Buffer log_likelihood;  ///< [theta, y, x], two floats each
};

/// Cuts an object's bins into slabs of whole theta planes, or, where a plane alone is too large for
/// a binding or a dispatch, into groups of its rows; in the lattice's order.
/// @param reduction_bins that one workgroup of a reduction covers
/// @throws Error where a single row is too large
std::vector<SlabExtent> cut_into_slabs(const gpu::Context& context, const PoseLattice& lattice,
                                       std::uint32_t reduction_bins);

}  // namespace palpate
