#include "estimation/bounded/leaves/map_extent.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

double farthest(const Axis& axis) { return std::max(std::abs(axis.lower), std::abs(axis.upper)); }

}  // namespace

double MapExtent::place_error(const KnownElements& elements) const {
  constexpr double v = 0x1p-53;
  double norm_cells = 0.0;
  for (const glm::dvec2& p_mm : elements.from_pivot_mm) {
    norm_cells = std::max(norm_cells, (std::abs(p_mm.x) + std::abs(p_mm.y)) / cell_mm);
  }
  // Rotation: cosine, sine, their quotients by the cell, two products and a sum. Bins: a
  // difference, a quotient and two sums.
  return 6.0 * v * std::min(norm_cells, 2.0 * reach_cells) +
         4.0 * v * (lattice_cells + reach_cells);
}

double MapExtent::change(double place_cells) const {
  return std::min(2.0 * place_cells * steepest, range);
}

MapExtent extent_of(const OccupancyGrid& map, double prior_log_odds, const PoseLattice& lattice) {
  double least = prior_log_odds;
  double most = prior_log_odds;
  for (const float cell : map.log_odds) {
    least = std::min(least, double{cell});
    most = std::max(most, double{cell});
  }
  MapExtent extent{.largest = std::max(std::abs(least), std::abs(most)),
                   .range = most - least,
                   .cell_mm = map.cell_mm};
  const auto cell = [&](int i, int j) {
    return i >= 0 && i < map.nx && j >= 0 && j < map.ny ? double{map.at(i, j)} : prior_log_odds;
  };
  for (int j = -1; j < map.ny; ++j) {
    for (int i = -1; i < map.nx; ++i) {
      const double here = cell(i, j);
      extent.steepest = std::max(
          {extent.steepest, std::abs(cell(i + 1, j) - here), std::abs(cell(i, j + 1) - here)});
    }
  }
  extent.lattice_cells = (std::max(farthest(lattice.x_mm), farthest(lattice.y_mm)) +
                          std::max(std::abs(map.origin_mm.x), std::abs(map.origin_mm.y))) /
                         map.cell_mm;
  extent.reach_cells = extent.lattice_cells + std::max(map.nx, map.ny) + 20.0;
  return extent;
}

}  // namespace palpate
