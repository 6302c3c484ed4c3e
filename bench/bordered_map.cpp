#include "bordered_map.hpp"

#include <algorithm>

#include "contact_evidence.hpp"

namespace palpate::bench {

std::vector<BorderedMap> bordered_maps(std::span<const Hypothesis> hypotheses,
                                       const PoseLattice& lattice, double prior) {
  constexpr int border = shaders::MAP_BORDER;
  std::vector<BorderedMap> maps;
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.map;
    BorderedMap& bordered = maps.emplace_back();
    bordered.cell_mm = map.cell_mm;
    bordered.width = map.nx + 2 * border;
    bordered.height = map.ny + 2 * border;
    bordered.log_odds.assign(static_cast<std::size_t>(bordered.width) * bordered.height,
                             static_cast<float>(log_odds_from_probability(prior)));
    for (int j = 0; j < map.ny; ++j) {
      std::copy_n(map.log_odds.begin() + j * map.nx, map.nx,
                  bordered.log_odds.begin() + (j + border) * bordered.width + border);
    }
    for (int i = 0; i < lattice.x_mm.count; ++i) {
      bordered.axes.push_back(
          split_axis((lattice.x_mm.centre(i) - map.origin_mm.x) / map.cell_mm + border));
    }
    for (int j = 0; j < lattice.y_mm.count; ++j) {
      bordered.axes.push_back(
          split_axis((lattice.y_mm.centre(j) - map.origin_mm.y) / map.cell_mm + border));
    }
  }
  return maps;
}

}  // namespace palpate::bench
