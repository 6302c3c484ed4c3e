#pragma once

#include <cstdint>
#include <string>

#include "gpu/kernel.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/lattice.hpp"

namespace palpate {

/// A way to evaluate the likelihood over the lattice, for maps of one cell size: a kernel of which
/// an invocation takes bins_x x bins_y bins of one theta. All of them bind the buffers of
/// shaders/likelihood_buffers.glsl.
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

}  // namespace palpate
