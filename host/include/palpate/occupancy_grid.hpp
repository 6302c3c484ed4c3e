#pragma once

#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

namespace palpate {

/// log(p / (1 - p)), Eq. 1.
double log_odds_from_probability(double p);
/// 1 / (1 + exp(-l)), without overflow.
double probability_from_log_odds(double l);

/// The map of one object: log odds of occupancy on a regular grid in the object frame. Cell
/// (row j, column i) is centred at origin_mm + cell_mm * (i, j). Everything beyond the grid holds
/// the prior, and interpolation across the border fades to it.
struct OccupancyGrid {
  std::string label;
  double cell_mm = 0.5;
  glm::dvec2 origin_mm{0.0, 0.0};  ///< centre of cell (0, 0)
  double prior = 0.2;              ///< p(m), probability that an unseen cell is occupied
  int symmetry = 1;                ///< n-fold rotational symmetry of the object; 0 = full
  /// Spread of the inverse sensor model that built it: a finer cell shows no more. None where that
  /// is not known.
  std::optional<double> spread_mm = {};
  int nx = 0;
  int ny = 0;
  std::vector<float> log_odds;  ///< [ny, nx], row-major

  float at(int i, int j) const { return log_odds[static_cast<std::size_t>(j) * nx + i]; }
  glm::dvec2 centre_mm(int i, int j) const { return origin_mm + cell_mm * glm::dvec2(i, j); }
  double prior_log_odds() const { return log_odds_from_probability(prior); }
};

}  // namespace palpate
