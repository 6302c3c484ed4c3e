#include "predicted_readings.hpp"

namespace palpate {

std::size_t reading_levels(const ContactModel& model) {
  return model.table ? model.table->levels() : 2;
}

std::vector<double> reading_log_likelihoods(std::span<const glm::dvec2> elements_mm,
                                            const Pose& T_object_sensor, const InterpolatedMap& map,
                                            const ContactModel& contact, std::size_t object) {
  const std::size_t levels = reading_levels(contact);
  std::vector<double> logs;
  logs.reserve(elements_mm.size() * levels);
  for (const glm::dvec2& element : elements_mm) {
    const MapSample sample{map.log_odds(T_object_sensor * element)};
    for (std::size_t level = 0; level < levels; ++level) {
      logs.push_back(contact.log_likelihood(static_cast<Reading>(level), sample, object));
    }
  }
  return logs;
}

}  // namespace palpate
