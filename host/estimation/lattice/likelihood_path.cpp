#include "likelihood_path.hpp"

#include <bit>
#include <cmath>

#include "interface.h"
#include "kernel_sizes.hpp"

namespace palpate {

namespace {

// Eight factors of at least this multiply to 1e-24, and the kernel's clamp of the odds at 2^-30
// changes them by less than one part in 1e6.
constexpr double least_product_floor = 1e-3;

constexpr gpu::Access bindings[] = {gpu::Access::table,  gpu::Access::storage, gpu::Access::table,
                                    gpu::Access::table,  gpu::Access::storage, gpu::Access::storage,
                                    gpu::Access::storage};

}  // namespace

std::vector<std::uint32_t> model_constants(const gpu::Limits& limits,
                                           const ContactLikelihood& model) {
  const double floor = model.gamma * model.prior;
  const bool in_logs = floor < least_product_floor;
  // A product of two small numbers may be 0 where both logarithms are sound.
  const double log_floor =
      model.gamma > 0.0 ? std::log(model.gamma) + std::log(model.prior) : shaders::NO_FLOOR;
  return {independent_lanes(limits),
          std::bit_cast<std::uint32_t>(static_cast<float>(in_logs ? log_floor : floor)),
          std::bit_cast<std::uint32_t>(static_cast<float>(1.0 - model.gamma)), in_logs ? 1U : 0U};
}

std::vector<std::uint32_t> path_constants(const gpu::Limits& limits, const MapKind& maps,
                                          const ContactLikelihood& model) {
  std::vector<std::uint32_t> constants = model_constants(limits, model);
  constants.push_back(maps.access == gpu::Access::table ? 1U : 0U);
  return constants;
}

std::span<const gpu::Access> likelihood_bindings() { return bindings; }

LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                           const MapKind& maps, const ContactLikelihood& model) {
  if (auto path = tile_path(context, lattice, objects, maps, model)) {
    return std::move(*path);
  }
  return row_path(context, lattice, objects, maps, model);
}

}  // namespace palpate
