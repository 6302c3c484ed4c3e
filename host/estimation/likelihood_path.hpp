#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "kernel.hpp"
#include "palpate/lattice.hpp"
#include "palpate/sensor_model.hpp"

namespace palpate {

/// A way to evaluate the likelihood over the lattice, for maps of one cell size: a kernel of which
/// an invocation takes bins_x x bins_y bins of one theta. All of them bind the same buffers.
struct LikelihoodPath {
  gpu::Kernel kernel;
  std::uint32_t bins_x = 1;
  std::uint32_t bins_y = 1;
  std::string description;  ///< what it does and why it was chosen
};

inline constexpr std::uint32_t likelihood_workgroup = 64;

/// What every path's kernel is specialised by: the workgroup, then the model of Eq. 7.
std::vector<std::uint32_t> model_constants(const ContactLikelihood& model);
/// The buffers of shaders/likelihood_buffers.glsl.
std::span<const gpu::Access> likelihood_bindings();

/// Most bins that an invocation may take so that a lattice of this many bins still fills the
/// device: a CPU device is full at once, a GPU wants tens of thousands of invocations.
std::uint32_t most_bins_per_invocation(const gpu::Context& context, std::int64_t bins);

/// Neighbouring bins in register tiles; none where the lattice is too coarse for the map's cells.
std::optional<LikelihoodPath> tile_path(gpu::Context& context, const PoseLattice& lattice,
                                        double cell_mm, const ContactLikelihood& model);
/// Bins of a row, each with map nodes of its own; for any lattice, in particular for those that
/// tile_path refuses.
LikelihoodPath row_path(gpu::Context& context, const PoseLattice& lattice, double cell_mm,
                        const ContactLikelihood& model);

/// The fastest of them that is sound.
LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, double cell_mm,
                           const ContactLikelihood& model);

}  // namespace palpate
