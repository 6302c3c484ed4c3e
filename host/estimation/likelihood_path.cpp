#include "likelihood_path.hpp"

#include <algorithm>
#include <bit>

namespace palpate {

namespace {

// Eight factors of at least this multiply to 1e-24, and the kernel's clamp of the odds at 2^-30
// changes them by less than one part in 1e6.
constexpr double least_product_floor = 1e-3;
constexpr std::int64_t invocations_that_fill_a_gpu = 1 << 16;

constexpr gpu::Access bindings[] = {gpu::Access::table, gpu::Access::storage, gpu::Access::table,
                                    gpu::Access::table, gpu::Access::storage};

}  // namespace

std::vector<std::uint32_t> model_constants(const ContactLikelihood& model) {
  const double floor = model.gamma * model.prior;
  return {likelihood_workgroup, std::bit_cast<std::uint32_t>(static_cast<float>(floor)),
          std::bit_cast<std::uint32_t>(static_cast<float>(1.0 - model.gamma)),
          floor < least_product_floor ? 1U : 0U};
}

std::span<const gpu::Access> likelihood_bindings() { return bindings; }

std::uint32_t most_bins_per_invocation(const gpu::Context& context, std::int64_t bins) {
  constexpr std::int64_t largest = 25;
  return static_cast<std::uint32_t>(
      context.limits().cpu
          ? largest
          : std::clamp<std::int64_t>(bins / invocations_that_fill_a_gpu, 1, largest));
}

LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, double cell_mm,
                           const ContactLikelihood& model) {
  if (auto path = tile_path(context, lattice, cell_mm, model)) {
    return std::move(*path);
  }
  return row_path(context, lattice, cell_mm, model);
}

}  // namespace palpate
