#include "recognition/reading_model.hpp"

#include <algorithm>
#include <cmath>

#include "model/predicted_readings.hpp"
#include "recognition/smooth_occupancy.hpp"

namespace palpate {

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
