#pragma once

#include <cstdint>
#include <vector>

#include "gpu/buffer.hpp"
#include "palpate/lattice.hpp"
#include "shaders/interface.h"

namespace palpate {

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
