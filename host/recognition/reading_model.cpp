#include "recognition/reading_model.hpp"

#include <algorithm>
#include <cmath>

#include "model/predicted_readings.hpp"
#include "model/touch_evidence.hpp"

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

LivingElements::LivingElements(const Touch& touch, const ContactModel& contact)
    : T_robot_sensor(touch.T_robot_sensor) {
  const TouchEvidence evidence(touch, contact);
  const std::vector<Reading>& readings = evidence.readings;
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if (evidence.lives[e] != 0) {
      elements.push_back({touch.elements_mm[e], readings[e] == Reading::unknown
                                                    ? reading_levels(contact)
                                                    : static_cast<std::size_t>(readings[e])});
    }
  }
}

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

ReadingModel::ReadingModel(const ContactModel& contact) : classes_(reading_levels(contact) + 1) {
  constexpr double unknown = 0.1;
  start_.resize(classes_ * nodes_, unknown);
  for (std::size_t node = 0; node < nodes_; ++node) {
    const double occupancy = static_cast<double>(node) / (nodes_ - 1);
    const MapSample sample{log_odds_of_occupancy(occupancy)};
    double sum = 0.0;
    for (std::size_t level = 0; level + 1 < classes_; ++level) {
      sum += start_[level * nodes_ + node] =
          std::exp(contact.log_likelihood(static_cast<Reading>(level), sample));
    }
    for (std::size_t level = 0; level + 1 < classes_; ++level) {
      start_[level * nodes_ + node] *= (1.0 - unknown) / sum;
    }
  }
  tabulate(start_);
}

void ReadingModel::tabulate(const std::vector<double>& probability) {
  log_p_.clear();
  for (std::size_t c = 0; c < classes_; ++c) {
    for (std::size_t i = 0; i < parts_; ++i) {
      const double place = (static_cast<double>(i) + 0.5) / parts_ * (nodes_ - 1);
      const auto node = std::min(static_cast<std::size_t>(place), nodes_ - 2);
      const double* at = &probability[c * nodes_ + node];
      const double part = place - static_cast<double>(node);
      log_p_.push_back(static_cast<float>(std::log(std::lerp(at[0], at[1], part))));
    }
  }
}

void ReadingModel::count(Counts& counts, std::size_t reading, double occupancy,
                         double weight) const {
  const double place = occupancy * (nodes_ - 1);
  const std::size_t node = std::min(static_cast<std::size_t>(place), nodes_ - 2);
  const double part = place - static_cast<double>(node);
  counts[reading * nodes_ + node] += weight * (1.0 - part);
  counts[reading * nodes_ + node + 1] += weight * part;
}

void ReadingModel::learn(const Counts& counts) {
  constexpr double known_before = 2.0;  // readings
  std::vector<double> probability(start_);
  for (std::size_t node = 0; node < nodes_; ++node) {
    double sum = known_before;
    for (std::size_t c = 0; c < classes_; ++c) {
      sum += counts[c * nodes_ + node];
    }
    for (std::size_t c = 0; c < classes_; ++c) {
      double& p = probability[c * nodes_ + node];
      p = (known_before * p + counts[c * nodes_ + node]) / sum;
    }
  }
  tabulate(probability);
}

}  // namespace palpate
