#include "estimation/lattice/likelihood_path.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <initializer_list>
#include <span>

#include <fmt/format.h>
#include <glm/vec2.hpp>

#include "estimation/contact_kernel.hpp"
#include "estimation/kernel_sizes.hpp"
#include "shaders/accumulate_rows.hpp"
#include "shaders/accumulate_tiles.hpp"
#include "shaders/interface.h"

namespace palpate {

namespace {

using gpu::Access;

constexpr std::uint32_t longest_run = 8;
constexpr std::uint32_t longest_edge = 5;

/// Neighbouring bins that an invocation takes, which together span at most `cells` cells.
struct Tile {
  std::uint32_t cells = 0;
  std::uint32_t x = 0;
  std::uint32_t y = 0;

  std::uint32_t bins() const { return x * y; }
};

std::uint32_t bins_within(std::uint32_t cells, double step_cells, int count) {
  const double most = 1.0 + std::floor(cells / std::max(step_cells, 1e-9) * (1.0 + 1e-12));
  return static_cast<std::uint32_t>(
      std::min({most, static_cast<double>(count), static_cast<double>(longest_edge)}));
}

Tile tile_within(std::uint32_t cells, const glm::dvec2& step_cells, const PoseLattice& lattice,
                 std::uint32_t most_bins) {
  Tile tile{.cells = cells,
            .x = bins_within(cells, step_cells.x, lattice.x_mm.count),
            .y = bins_within(cells, step_cells.y, lattice.y_mm.count)};
  while (tile.bins() > most_bins) {
    (tile.x > tile.y ? tile.x : tile.y) -= 1;
  }
  return tile;
}

/// Fewest bins with which a tile is faster than runs of bins. On a CPU device a run takes as long
/// as a tile of nine over two cells, measured. A GPU waits for fetches: a tile has four, a run one
/// a bin.
std::uint32_t least_bins(const gpu::Limits& limits) { return limits.cpu ? 10 : 5; }

/// The run length that covers a row with the fewest bins beyond its end, the longest of equals.
std::uint32_t run_for(std::uint32_t nx, std::uint32_t longest) {
  std::uint32_t best = 1;
  for (std::uint32_t run = 1; run <= std::min(nx, longest); ++run) {
    // Sharing the element's load is worth a little waste.
    const auto cost = [nx](std::uint32_t r) { return groups_of(nx, r) * (r + 1); };
    if (cost(run) <= cost(best)) {
      best = run;
    }
  }
  return best;
}

/// @param shape what this kernel alone is specialised by
gpu::Kernel kernel_of(gpu::Context& context, const char* name, std::span<const std::uint32_t> spirv,
                      const MapKind& maps, const ContactModel& model,
                      std::initializer_list<std::uint32_t> shape) {
  std::vector<std::uint32_t> constants = contact_constants(context.limits(), model);
  constants.push_back(maps.access == Access::table ? 1U : 0U);
  constants.insert(constants.end(), shape);
  return {context,
          {.name = name,
           .spirv = spirv,
           .bindings = {Access::table, Access::table, Access::table, Access::table, Access::storage,
                        Access::storage, Access::storage, Access::storage},
           .push_bytes = sizeof(shaders::LikelihoodPush),
           .constants = constants}};
}

}  // namespace

LikelihoodPath choose_path(gpu::Context& context, const PoseLattice& lattice, std::size_t objects,
                           const MapKind& maps, const ContactModel& model) {
  const gpu::Limits& limits = context.limits();
  const glm::dvec2 step_cells = glm::dvec2(lattice.x_mm.step(), lattice.y_mm.step()) / maps.cell_mm;
  const std::uint32_t most_bins =
      most_bins_per_invocation(limits, lattice.bins() * static_cast<std::int64_t>(objects));
  Tile tile = tile_within(1, step_cells, lattice, most_bins);
  // Sixteen nodes in the place of nine cost a fifth more a bin, but are shared: measured, 5 x 5
  // bins over two cells take three quarters of the time of 3 x 3 over one, and as long as 4 x 4.
  if (const Tile wide = tile_within(2, step_cells, lattice, most_bins);
      wide.bins() >= 2 * tile.bins()) {
    tile = wide;
  }
  if (tile.bins() >= least_bins(limits)) {
    const auto bits = [](double value) {
      return std::bit_cast<std::uint32_t>(static_cast<float>(value));
    };
    return {
        .kernel = kernel_of(context, "accumulate_tiles", shaders::accumulate_tiles, maps, model,
                            {tile.x, tile.y, bits(step_cells.x), bits(step_cells.y), tile.cells}),
        .bins_x = tile.x,
        .bins_y = tile.y,
        .description = fmt::format("register tiles of {} x {} bins over {} of a side: the "
                                   "lattice's step is {:.3g} x {:.3g} of a map cell",
                                   tile.x, tile.y, tile.cells == 1 ? "one cell" : "two cells",
                                   step_cells.x, step_cells.y)};
  }
  const std::uint32_t run =
      run_for(static_cast<std::uint32_t>(lattice.x_mm.count), std::min(longest_run, most_bins));
  return {
      .kernel = kernel_of(context, "accumulate_rows", shaders::accumulate_rows, maps, model, {run}),
      .bins_x = run,
      .bins_y = 1,
      .description = fmt::format("runs of {} bins: at a lattice step of {:.3g} x {:.3g} map "
                                 "cells fewer bins than a tile needs lie side by side{}",
                                 run, step_cells.x, step_cells.y,
                                 limits.cpu ? "" : ", or tiles leave the GPU idle")};
}

}  // namespace palpate
