#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "kernel.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A way to evaluate the likelihood over the lattice, for maps of one cell size: a kernel of which
/// an invocation takes bins_x x bins_y bins of one theta. All of them bind the same buffers.
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

/// What every path's kernel is specialised by: contact_constants(), and the maps' place.
std::vector<std::uint32_t> path_constants(const gpu::Limits& limits, const MapKind& maps,
                                          const ContactModel& model);
/// The buffers of shaders/likelihood_buffers.glsl.
std::span<const gpu::Access> likelihood_bindings();

/// Neighbouring bins in register tiles; none where too few lie side by side
/// within two of the map's cells.
std::optional<LikelihoodPath> tile_path(gpu::Context& context, const PoseLattice& lattice,
                                        std::size_t objects, const MapKind& maps,
                                        const ContactModel& model);
/// Bins of a row, each with map nodes of its own; for any lattice, in particular for those that
/// tile_path refuses.
LikelihoodPath row_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                        const MapKind& maps, const ContactModel& model);

/// The fastest of them that is sound.
/// @param objects whose bins a dispatch takes together
LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                           const MapKind& maps, const ContactModel& model);

}  // namespace palpate
