#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "accumulate_tiles.hpp"
#include "interface.h"
#include "kernel_sizes.hpp"
#include "likelihood_path.hpp"

namespace palpate {

namespace {

constexpr std::uint32_t largest_tile = 5;

/// Most neighbouring bins of an axis that together span at most one cell.
std::uint32_t bins_in_a_cell(double step_cells, int count) {
  const double most = 1.0 + std::floor(1.0 / std::max(step_cells, 1e-9) * (1.0 + 1e-12));
  return static_cast<std::uint32_t>(
      std::min({most, static_cast<double>(count), static_cast<double>(largest_tile)}));
}

}  // namespace

std::optional<LikelihoodPath> tile_path(gpu::Context& context, const PoseLattice& lattice,
                                        std::size_t objects, const MapKind& maps,
                                        const ContactLikelihood& model) {
  const double step_x = lattice.x_mm.step() / maps.cell_mm;
  const double step_y = lattice.y_mm.step() / maps.cell_mm;
  std::uint32_t x = bins_in_a_cell(step_x, lattice.x_mm.count);
  std::uint32_t y = bins_in_a_cell(step_y, lattice.y_mm.count);
  const std::uint32_t most = most_bins_per_invocation(
      context.limits(), lattice.bins() * static_cast<std::int64_t>(objects));
  while (x * y > most) {
    (x > y ? x : y) -= 1;
  }
  // A tile fetches four times: below four bins a row, which fetches once per bin, costs less.
  if (x * y < 4) {
    return {};
  }
  std::vector<std::uint32_t> constants = path_constants(context.limits(), maps, model);
  constants.insert(constants.end(), {x, y, std::bit_cast<std::uint32_t>(static_cast<float>(step_x)),
                                     std::bit_cast<std::uint32_t>(static_cast<float>(step_y))});
  return LikelihoodPath{
      .kernel = {context,
                 {.name = "accumulate_tiles",
                  .spirv = shaders::accumulate_tiles,
                  .bindings = likelihood_bindings(),
                  .push_bytes = sizeof(shaders::LikelihoodPush),
                  .constants = constants}},
      .bins_x = x,
      .bins_y = y,
      .description = fmt::format("register tiles of {} x {} bins: the lattice's step is {:.3g} x "
                                 "{:.3g} of a map cell",
                                 x, y, step_x, step_y)};
}

}  // namespace palpate
