#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "estimation/bordered_map.hpp"
#include "estimation/contact_kernel.hpp"
#include "gpu/command_stream.hpp"
#include "gpu/kernel.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/estimate.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A way to evaluate the likelihood over the lattice, for maps of one cell size: the
/// kernel accumulate_likelihood, of which an invocation takes bins_x x bins_y bins of one theta.
struct LikelihoodPath {
  gpu::Kernel kernel;
  std::uint32_t bins_x = 1;
  std::uint32_t bins_y = 1;
  std::string description;  ///< what it does and why it was chosen
};

/// What a path is made for: maps of one cell size that kernels read in one way.
struct MapKind {
  double cell_mm = 0.0;
  /// Tables are the fast way, which not every device has for large maps.
  gpu::Access access = gpu::Access::table;

  bool operator==(const MapKind&) const = default;
};

/// Chooses neighbouring bins in register tiles or, where too few bins lie side by side within two
/// of the map's cells, runs of bins of a row.
/// @param objects whose bins a dispatch takes together
LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                           const MapKind& maps, const ContactModel& model);

/// Objects whose maps are of one kind and, like their axes, together no larger than what a kernel
/// reads at once.
struct MapGroup {
  MapKind kind;
  std::uint64_t cells = 0;           ///< that the maps take in a buffer
  std::vector<std::size_t> objects;  ///< ascending
};

/// Puts every hypothesis's map into a group.
/// @throws Error where a map, or the lattice along x and y, is larger than what kernels read
std::vector<MapGroup> group_maps(const gpu::Context& context,
                                 std::span<const Hypothesis> hypotheses,
                                 const PoseLattice& lattice);

/// The maps of a group on the device, one after the other, and what a kernel needs to find each.
struct MapTable {
  /// Records the upload. Beyond each map lies the prior.
  /// @param first_bins ObjectPlace::first_bin of every hypothesis
  MapTable(gpu::Context& context, gpu::CommandStream& stream, const MapGroup& group,
           std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
           std::span<const std::uint32_t> first_bins, double prior, const ContactTable& contact);

  std::uint64_t device_bytes() const {
    return maps.nodes().bytes() + axes.bytes() + places.bytes();
  }

  BorderedMaps maps;
  gpu::Buffer
      axes;  ///< the lattice's x centres, then its y centres, in cells of each map, [object]
  gpu::Buffer places;  ///< shaders::ObjectPlace, [object]
};

}  // namespace palpate
