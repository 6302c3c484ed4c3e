#include "model/interpolated_map.hpp"

#include <cmath>

namespace palpate {

InterpolatedMap::InterpolatedMap(const OccupancyGrid& map, double prior)
    : map_(map), beyond_(log_odds_from_probability(prior)) {}

double InterpolatedMap::log_odds(const glm::dvec2& p_object_mm) const {
  const glm::dvec2 place = (p_object_mm - map_.origin_mm) / map_.cell_mm;
  const double column = std::floor(place.x);
  const double row = std::floor(place.y);
  // In doubles: the place may lie beyond what an int holds.
  if (!(column >= -1.0 && column < map_.nx && row >= -1.0 && row < map_.ny)) {
    return beyond_;
  }
  const auto i = static_cast<int>(column);
  const auto j = static_cast<int>(row);
  const double fx = place.x - column;
  return std::lerp(std::lerp(cell(i, j), cell(i + 1, j), fx),
                   std::lerp(cell(i, j + 1), cell(i + 1, j + 1), fx), place.y - row);
}

double InterpolatedMap::cell(int i, int j) const {
  const bool inside = i >= 0 && i < map_.nx && j >= 0 && j < map_.ny;
  return inside ? static_cast<double>(map_.at(i, j)) : beyond_;
}

}  // namespace palpate
