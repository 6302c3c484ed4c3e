#pragma once

#include <glm/vec2.hpp>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

/// A map's log odds, interpolated bilinearly; every cell beyond the map holds the prior's.
class InterpolatedMap {
 public:
  /// @param map outlives this object
  InterpolatedMap(const OccupancyGrid& map, double prior);

  double log_odds(const glm::dvec2& p_object_mm) const;

 private:
  double cell(int i, int j) const;

  const OccupancyGrid& map_;
  double beyond_;
};

}  // namespace palpate
