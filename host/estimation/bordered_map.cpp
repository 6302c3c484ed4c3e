#include "bordered_map.hpp"

#include <algorithm>
#include <cstddef>

#include "interface.h"

namespace palpate {

std::vector<float> with_border(const OccupancyGrid& map, double prior) {
  constexpr int border = shaders::MAP_BORDER;
  const int width = map.nx + 2 * border;
  std::vector<float> cells(static_cast<std::size_t>(width) * (map.ny + 2 * border),
                           static_cast<float>(log_odds_from_probability(prior)));
  for (int j = 0; j < map.ny; ++j) {
    const auto row = map.log_odds.begin() + static_cast<std::ptrdiff_t>(j) * map.nx;
    std::copy(row, row + map.nx,
              cells.begin() + static_cast<std::ptrdiff_t>(j + border) * width + border);
  }
  return cells;
}

}  // namespace palpate
