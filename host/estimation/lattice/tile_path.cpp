#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>
#include <glm/vec2.hpp>

#include "accumulate_tiles.hpp"
#include "interface.h"
#include "kernel_sizes.hpp"
#include "likelihood_path.hpp"

namespace palpate {

namespace {

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

}  // namespace

std::optional<LikelihoodPath> tile_path(gpu::Context& context, const PoseLattice& lattice,
                                        std::size_t objects, const MapKind& maps,
                                        const ContactModel& model) {
  const glm::dvec2 step_cells = glm::dvec2(lattice.x_mm.step(), lattice.y_mm.step()) / maps.cell_mm;
  const std::uint32_t most_bins = most_bins_per_invocation(
      context.limits(), lattice.bins() * static_cast<std::int64_t>(objects));
  Tile tile = tile_within(1, step_cells, lattice, most_bins);
  // Sixteen nodes in the place of nine cost a fifth more a bin, but are shared: measured, 5 x 5
  // bins over two cells take three quarters of the time of 3 x 3 over one, and as long as 4 x 4.
  if (const Tile wide = tile_within(2, step_cells, lattice, most_bins);
      wide.bins() >= 2 * tile.bins()) {
    tile = wide;
  }
  if (tile.bins() < least_bins(context.limits())) {
    return {};
  }
  std::vector<std::uint32_t> constants = path_constants(context.limits(), maps, model);
  constants.insert(constants.end(),
                   {tile.x, tile.y, std::bit_cast<std::uint32_t>(static_cast<float>(step_cells.x)),
                    std::bit_cast<std::uint32_t>(static_cast<float>(step_cells.y)), tile.cells});
  return LikelihoodPath{
      .kernel = {context,
                 {.name = "accumulate_tiles",
                  .spirv = shaders::accumulate_tiles,
                  .bindings = likelihood_bindings(),
                  .push_bytes = sizeof(shaders::LikelihoodPush),
                  .constants = constants}},
      .bins_x = tile.x,
      .bins_y = tile.y,
      .description = fmt::format("register tiles of {} x {} bins over {} of a side: the lattice's "
                                 "step is {:.3g} x {:.3g} of a map cell",
                                 tile.x, tile.y, tile.cells == 1 ? "one cell" : "two cells",
                                 step_cells.x, step_cells.y)};
}

}  // namespace palpate
