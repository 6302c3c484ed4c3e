#include "model/predicted_readings.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {

namespace {

/// ContactModel::log_likelihood() of No Contact and In Contact by Eq. 7 with gamma > 0, in a third
/// of its time: gamma m keeps both arguments of the logarithm away from 0.
class BothReadings {
 public:
  explicit BothReadings(const ContactModel& contact)
      : floor_(contact.gamma * contact.prior.value()), share_(1.0 - contact.gamma) {}

  void add(double log_odds, std::vector<double>& logs) const {
    const double less = std::exp(-std::abs(log_odds));  // never overflows
    const double more_likely = std::log(floor_ + share_ / (1.0 + less));
    const double less_likely = std::log(floor_ + share_ * less / (1.0 + less));
    logs.push_back(log_odds > 0.0 ? less_likely : more_likely);
    logs.push_back(log_odds > 0.0 ? more_likely : less_likely);
  }

 private:
  double floor_;
  double share_;
};

}  // namespace

std::size_t reading_levels(const ContactModel& model) {
  return model.table ? model.table->levels() : 2;
}

std::vector<double> reading_log_likelihoods(std::span<const glm::dvec2> elements_mm,
                                            const Pose& T_object_sensor, const InterpolatedMap& map,
                                            const ContactModel& contact, std::size_t object) {
  const std::size_t levels = reading_levels(contact);
  std::vector<double> logs;
  logs.reserve(elements_mm.size() * levels);
  if (!contact.table && contact.gamma > 0.0) {
    const BothReadings both(contact);
    const glm::dvec2 along_x = rotate(T_object_sensor.theta_rad, {1.0, 0.0});
    const glm::dvec2 along_y = rotate(T_object_sensor.theta_rad, {0.0, 1.0});
    for (const glm::dvec2& element : elements_mm) {
      both.add(
          map.log_odds(T_object_sensor.translation_mm + element.x * along_x + element.y * along_y),
          logs);
    }
    return logs;
  }
  for (const glm::dvec2& element : elements_mm) {
    const MapSample sample{map.log_odds(T_object_sensor * element)};
    for (std::size_t level = 0; level < levels; ++level) {
      logs.push_back(contact.log_likelihood(static_cast<Reading>(level), sample, object));
    }
  }
  return logs;
}

PredictedReading predicted_reading(std::span<const double> log_likelihood) {
  PredictedReading predicted;
  predicted.most = *std::max_element(log_likelihood.begin(), log_likelihood.end());
  double total = 0.0;
  for (std::size_t level = 0; level < log_likelihood.size(); ++level) {
    total += predicted.probability[level] = std::exp(log_likelihood[level] - predicted.most);
  }
  // The mean relative to the largest: no cancellation.
  for (std::size_t level = 0; level < log_likelihood.size(); ++level) {
    predicted.probability[level] /= total;
    predicted.below_most += predicted.probability[level] * (log_likelihood[level] - predicted.most);
  }
  return predicted;
}

}  // namespace palpate
