#include "palpate/occupancy_grid.hpp"

#include <cmath>

namespace palpate {

double log_odds_from_probability(double p) { return std::log(p) - std::log1p(-p); }

double probability_from_log_odds(double l) {
  const double z = std::exp(-std::abs(l));
  return (l >= 0 ? 1.0 : z) / (1.0 + z);
}

}  // namespace palpate
