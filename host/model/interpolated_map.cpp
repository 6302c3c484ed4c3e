#include "model/interpolated_map.hpp"

namespace palpate {

InterpolatedMap::InterpolatedMap(const OccupancyGrid& map, double prior)
    : map_(map), beyond_(log_odds_from_probability(prior)) {}

double InterpolatedMap::cell(int i, int j) const {
  const bool inside = i >= 0 && i < map_.nx && j >= 0 && j < map_.ny;
  return inside ? static_cast<double>(map_.at(i, j)) : beyond_;
}

}  // namespace palpate
