#include "palpate/learned_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "model/refuse.hpp"

namespace palpate {

namespace {

/// Squared distances, in cells, and the cell that each is to.
struct Nearest {
  std::vector<double> squared;
  std::vector<std::int64_t> cell;
};

/// Along one row or column: replaces each distance by the least sum of one of the line's distances
/// and the squared steps to it (Felzenszwalb and Huttenlocher, Theory of Computing 8, 2012).
void spread_along(Nearest& nearest, std::size_t first, std::size_t stride, int count) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  struct Parabola {
    int place;
    double from;  ///< where on the line it becomes the least
    double squared;
    std::int64_t cell;
  };
  const auto at = [&](int i) { return first + static_cast<std::size_t>(i) * stride; };
  std::vector<Parabola> least;
  for (int i = 0; i < count; ++i) {
    const double height = nearest.squared[at(i)];
    if (height == infinity) {
      continue;
    }
    double from = -infinity;
    while (!least.empty()) {
      const auto& [other, other_from, other_height, cell] = least.back();
      from =
          ((height + double(i) * i) - (other_height + double(other) * other)) / (2.0 * (i - other));
      if (from > other_from) {
        break;
      }
      least.pop_back();
      from = -infinity;
    }
    least.push_back({i, from, height, nearest.cell[at(i)]});
  }
  std::size_t k = 0;
  for (int i = 0; i < count && !least.empty(); ++i) {
    while (k + 1 < least.size() && least[k + 1].from < i) {
      ++k;
    }
    nearest.squared[at(i)] = least[k].squared + double(i - least[k].place) * (i - least[k].place);
    nearest.cell[at(i)] = least[k].cell;
  }
}

double value_of_level(double level, const ReadingLayer& settings) {
  const double share = std::log1p(level / settings.unit_level) /
                       std::log1p(settings.full_level / settings.unit_level);
  return ReadingLayer::largest_value * std::min(2.0 * share - 1.0, 1.0);
}

}  // namespace

void ReadingLayer::validate() const {
  if (!(near_mm >= 0.0 && near_mm <= far_mm && far_mm <= most_length_mm)) {
    refuse("unseen cells", "near {} mm and far {} mm: give ascending ones from 0", near_mm, far_mm);
  }
  if (!(unit_level > 0.0 && std::isfinite(unit_level) && full_level > 0.0 &&
        std::isfinite(full_level))) {
    refuse("mean level", "unit {} and full {}: give positive numbers", unit_level, full_level);
  }
}

OccupancyGrid reading_layer(const OccupancyGrid& map, const ReadingLayer& settings) {
  settings.validate();
  require_sound_map(map);
  if (settings.of == MapLayer::mean_level && map.mean_level.empty()) {
    refuse(fmt::format("map '{}'", map.label),
           "no mean level, which the sensor model compares readings with; build it with palpate "
           "map `sensor-model`");
  }
  const auto border = static_cast<std::int64_t>(std::ceil(settings.far_mm / map.cell_mm)) + 1;
  const std::int64_t nx = map.nx + 2 * border;
  const std::int64_t ny = map.ny + 2 * border;
  if (nx > most_cells / ny) {
    refuse(fmt::format("map '{}'", map.label),
           "{} x {} cells with the {} mm around them are too many; use larger cells", map.nx,
           map.ny, settings.far_mm);
  }
  OccupancyGrid layer = map;
  layer.prior = probability_from_log_odds(ReadingLayer::beyond);
  layer.origin_mm -= map.cell_mm * static_cast<double>(border);
  layer.nx = static_cast<int>(nx);
  layer.ny = static_cast<int>(ny);
  layer.observations.clear();
  layer.mean_level.clear();
  const auto cells = static_cast<std::size_t>(nx * ny);
  layer.log_odds.assign(cells, static_cast<float>(ReadingLayer::beyond));

  const auto prior = static_cast<float>(map.prior_log_odds());
  Nearest nearest{std::vector<double>(cells, std::numeric_limits<double>::infinity()),
                  std::vector<std::int64_t>(cells, -1)};
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * map.nx + i;
      const auto at = static_cast<std::size_t>((j + border) * nx + i + border);
      const bool sensed =
          map.observations.empty() ? map.log_odds[k] != prior : map.observations[k] > 0.0F;
      if (sensed) {
        nearest.squared[at] = 0.0;
        nearest.cell[at] = static_cast<std::int64_t>(k);
        const double value = settings.of == MapLayer::mean_level
                                 ? value_of_level(map.mean_level[k], settings)
                                 : double{map.log_odds[k]};
        layer.log_odds[at] = static_cast<float>(
            std::clamp(value, -ReadingLayer::largest_value, ReadingLayer::largest_value));
      }
    }
  }
  for (std::int64_t j = 0; j < ny; ++j) {
    spread_along(nearest, static_cast<std::size_t>(j * nx), 1, layer.nx);
  }
  for (std::int64_t i = 0; i < nx; ++i) {
    spread_along(nearest, static_cast<std::size_t>(i), static_cast<std::size_t>(nx), layer.ny);
  }
  const auto squared = [&](double mm) { return mm * mm / (map.cell_mm * map.cell_mm); };
  for (std::size_t at = 0; at < cells; ++at) {
    if (nearest.squared[at] > 0.0 && nearest.cell[at] >= 0) {
      const bool occupied = map.log_odds[static_cast<std::size_t>(nearest.cell[at])] > 0.0F;
      const double value =
          nearest.squared[at] <= squared(settings.near_mm)
              ? (occupied ? ReadingLayer::near_occupied : ReadingLayer::near_free)
          : nearest.squared[at] <= squared(settings.far_mm)
              ? (occupied ? ReadingLayer::midway_occupied : ReadingLayer::midway_free)
              : ReadingLayer::beyond;
      layer.log_odds[at] = static_cast<float>(value);
    }
  }
  return layer;
}

}  // namespace palpate
