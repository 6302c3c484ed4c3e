#include "estimation/bounded/search/seen_tiles.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
namespace palpate {

namespace {

/// The tiles of an axis that overlap [lower, upper] in mm.
std::pair<int, int> overlapping(const TileAxis& axis, double lower_mm, double upper_mm) {
  // Rounding must not leave a tile out.
  const auto tiles = static_cast<double>(axis.tiles());
  const double first = std::floor((lower_mm - axis.first_mm) / axis.side_mm - 1e-6);
  const double last = std::floor((upper_mm - axis.first_mm) / axis.side_mm + 1e-6);
  return {static_cast<int>(std::clamp(first, 0.0, tiles)),
          static_cast<int>(std::clamp(last + 1.0, 0.0, tiles))};
}

}  // namespace

std::vector<BoundingBox> reaches_of(const KnownElements& elements,
                                    std::span<const glm::dvec2> turns) {
  std::vector<BoundingBox> reaches(turns.size());
  for (std::size_t theta = 0; theta < turns.size(); ++theta) {
    const glm::dvec2& turn = turns[theta];
    for (const glm::dvec2& p : elements.from_pivot_mm) {
      reaches[theta].take_in({turn.x * p.x - turn.y * p.y, turn.y * p.x + turn.x * p.y});
    }
  }
  return reaches;
}

TileRange seen_tiles(const BoundingBox& reach, const OccupancyGrid& map, const TileLevel& level) {
  if (reach.empty()) {
    return {};
  }
  // The map fades to the prior within a cell.
  const glm::dvec2 lower_mm = map.origin_mm - map.cell_mm - reach.upper;
  const glm::dvec2 upper_mm =
      map.origin_mm + map.cell_mm * glm::dvec2(map.nx, map.ny) - reach.lower;
  const auto [x_first, x_end] = overlapping(level.x, lower_mm.x, upper_mm.x);
  const auto [y_first, y_end] = overlapping(level.y, lower_mm.y, upper_mm.y);
  return {x_first, std::max(x_first, x_end), y_first, std::max(y_first, y_end)};
}

}  // namespace palpate
