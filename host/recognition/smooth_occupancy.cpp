#include "recognition/smooth_occupancy.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

constexpr double middle_nats = 4.0;  ///< at which a cell counts half
constexpr double width_nats = 2.0;

double occupancy_of_log_odds(double log_odds) {
  return probability_from_log_odds((log_odds - middle_nats) / width_nats);
}

/// Blurs [rows, columns] along the rows, and returns the transposed; beyond is 0.
std::vector<float> blurred_and_transposed(const std::vector<float>& values, int columns, int rows,
                                          const std::vector<double>& weights) {
  const int reach = static_cast<int>(weights.size() / 2);
  std::vector<float> blurred(values.size());
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      double sum = 0.0;
      for (std::size_t w = 0; w < weights.size(); ++w) {
        const int from = std::clamp(i + static_cast<int>(w) - reach, 0, columns - 1);
        sum += weights[w] * values[static_cast<std::size_t>(j) * columns + from];
      }
      blurred[static_cast<std::size_t>(i) * rows + j] = static_cast<float>(sum);
    }
  }
  return blurred;
}

/// Weights of a Gaussian, which sum to 1.
std::vector<double> gaussian(double sd) {
  constexpr double cut = 3.0;
  constexpr int widest = 1000;  // cells
  const int reach = static_cast<int>(std::min<double>(widest, std::ceil(cut * sd)));
  std::vector<double> weights;
  double sum = 0.0;
  for (int k = -reach; k <= reach; ++k) {
    sum += weights.emplace_back(std::exp(-0.5 * k * k / (sd * sd)));
  }
  for (double& weight : weights) {
    weight /= sum;
  }
  return weights;
}

}  // namespace

double log_odds_of_occupancy(double occupancy) {
  constexpr double nearly_certain = 1e-4;
  return middle_nats + width_nats * log_odds_from_probability(std::clamp(occupancy, nearly_certain,
                                                                         1.0 - nearly_certain));
}

SmoothOccupancy::SmoothOccupancy(const OccupancyGrid& map, const ContactModel& contact)
    : first_mm_(map.origin_mm - glm::dvec2(map.cell_mm)),
      cell_mm_(map.cell_mm),
      columns_(map.nx + 2),
      rows_(map.ny + 2),
      occupancy_(static_cast<std::size_t>(columns_) * rows_,
                 static_cast<float>(
                     occupancy_of_log_odds(log_odds_from_probability(contact.prior.value())))) {
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      occupancy_[static_cast<std::size_t>(j + 1) * columns_ + i + 1] =
          static_cast<float>(occupancy_of_log_odds(static_cast<double>(map.at(i, j))));
    }
  }
  constexpr double blur_per_spread = 1.4;
  const std::vector<double> weights =
      gaussian(blur_per_spread * map.spread_mm.value_or(map.cell_mm) / map.cell_mm);
  const std::vector<float> along_x = blurred_and_transposed(occupancy_, columns_, rows_, weights);
  occupancy_ = blurred_and_transposed(along_x, rows_, columns_, weights);
}

}  // namespace palpate
