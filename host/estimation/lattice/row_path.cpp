#include <algorithm>

#include <fmt/format.h>

#include "accumulate_rows.hpp"
#include "interface.h"
#include "kernel_sizes.hpp"
#include "likelihood_path.hpp"

namespace palpate {

namespace {

constexpr std::uint32_t longest_run = 8;

/// The run length that covers a row with the fewest bins beyond its end, the longest of equals.
std::uint32_t run_for(std::uint32_t nx, std::uint32_t longest) {
  std::uint32_t best = 1;
  for (std::uint32_t run = 1; run <= std::min(nx, longest); ++run) {
    // Sharing the element's load is worth a little waste.
    const auto cost = [nx](std::uint32_t r) { return (nx + r - 1) / r * (r + 1); };
    if (cost(run) <= cost(best)) {
      best = run;
    }
  }
  return best;
}

}  // namespace

LikelihoodPath row_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                        const MapKind& maps, const ContactModel& model) {
  const std::int64_t bins = lattice.bins() * static_cast<std::int64_t>(objects);
  const std::uint32_t run =
      run_for(static_cast<std::uint32_t>(lattice.x_mm.count),
              std::min(longest_run, most_bins_per_invocation(context.limits(), bins)));
  std::vector<std::uint32_t> constants = path_constants(context.limits(), maps, model);
  constants.push_back(run);
  return {.kernel = {context,
                     {.name = "accumulate_rows",
                      .spirv = shaders::accumulate_rows,
                      .bindings = likelihood_bindings(),
                      .push_bytes = sizeof(shaders::LikelihoodPush),
                      .constants = constants}},
          .bins_x = run,
          .bins_y = 1,
          .description = fmt::format("runs of {} bins: at a lattice step of {:.3g} x {:.3g} map "
                                     "cells fewer bins than a tile needs lie side by side{}",
                                     run, lattice.x_mm.step() / maps.cell_mm,
                                     lattice.y_mm.step() / maps.cell_mm,
                                     context.limits().cpu ? "" : ", or tiles leave the GPU idle")};
}

}  // namespace palpate
