#include "likelihood_path.hpp"

#include "contact_kernel.hpp"

namespace palpate {

namespace {

constexpr gpu::Access bindings[] = {
    gpu::Access::table,   gpu::Access::table,   gpu::Access::table,   gpu::Access::table,
    gpu::Access::storage, gpu::Access::storage, gpu::Access::storage, gpu::Access::storage};

}  // namespace

std::vector<std::uint32_t> path_constants(const gpu::Limits& limits, const MapKind& maps,
                                          const ContactModel& model) {
  std::vector<std::uint32_t> constants = contact_constants(limits, model);
  constants.push_back(maps.access == gpu::Access::table ? 1U : 0U);
  return constants;
}

std::span<const gpu::Access> likelihood_bindings() { return bindings; }

LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                           const MapKind& maps, const ContactModel& model) {
  if (auto path = tile_path(context, lattice, objects, maps, model)) {
    return std::move(*path);
  }
  return row_path(context, lattice, objects, maps, model);
}

}  // namespace palpate
