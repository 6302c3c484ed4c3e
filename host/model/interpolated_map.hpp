#pragma once

#include <cstddef>

#include <glm/vec2.hpp>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A map's log odds, interpolated bilinearly; every cell beyond the map holds the prior's.
class InterpolatedMap {
 public:
  /// @param map outlives this object
  InterpolatedMap(const OccupancyGrid& map, double prior)
      : map_(map), beyond_(log_odds_from_probability(prior)) {}

  double log_odds(const glm::dvec2& p_object_mm) const {
    const glm::dvec2 place = (p_object_mm - map_.origin_mm) / map_.cell_mm;
    // In doubles: the place may lie beyond what an int holds.
    if (!(place.x >= -1.0 && place.x < map_.nx && place.y >= -1.0 && place.y < map_.ny)) {
      return beyond_;
    }
    const int i = floor_of(place.x);
    const int j = floor_of(place.y);
    const double fx = place.x - i;
    const double fy = place.y - j;
    const bool inside = i >= 0 && i + 1 < map_.nx && j >= 0 && j + 1 < map_.ny;
    if (!inside) {
      return between(between(cell(i, j), cell(i + 1, j), fx),
                     between(cell(i, j + 1), cell(i + 1, j + 1), fx), fy);
    }
    const float* lower = map_.log_odds.data() + static_cast<std::ptrdiff_t>(j) * map_.nx + i;
    const float* upper = lower + map_.nx;
    return between(between(lower[0], lower[1], fx), between(upper[0], upper[1], fx), fy);
  }

 private:
  /// std::floor() is a call where the instruction set need not have it.
  static int floor_of(double value) {
    const auto whole = static_cast<int>(value);
    return whole - static_cast<int>(value < whole);
  }
  static double between(double a, double b, double share) { return a + share * (b - a); }
  double cell(int i, int j) const {
    const bool inside = i >= 0 && i < map_.nx && j >= 0 && j < map_.ny;
    return inside ? static_cast<double>(map_.at(i, j)) : beyond_;
  }

  const OccupancyGrid& map_;
  double beyond_;
};

}  // namespace palpate
