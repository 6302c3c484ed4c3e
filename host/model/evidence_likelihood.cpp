#include "model/evidence_likelihood.hpp"

namespace palpate {

EvidenceLikelihood::EvidenceLikelihood(const InterpolatedMap& map, const ContactModel& contact,
                                       std::size_t object)
    : map_(map),
      nodes_(contact.table.value().nodes),
      last_node_(static_cast<double>(nodes_ - 1)),
      first_log_odds_(contact.table->first_log_odds),
      nodes_per_nat_(last_node_ / (contact.table->last_log_odds - contact.table->first_log_odds)) {
  const std::size_t of_a_set = contact.table->levels() * nodes_;
  const auto own = contact.table->log_likelihood.begin() +
                   static_cast<std::ptrdiff_t>(contact.table->sets() == 1 ? 0 : object * of_a_set);
  nats_.assign(own, own + static_cast<std::ptrdiff_t>(of_a_set));
}

double EvidenceLikelihood::at(const TouchEvidence& touch, const Pose& T_object_sensor) const {
  const glm::dvec2 along_x = rotate(T_object_sensor.theta_rad, {1.0, 0.0});
  const glm::dvec2 along_y = rotate(T_object_sensor.theta_rad, {0.0, 1.0});
  double sum = 0.0;
  for (std::size_t e = 0; e < touch.readings.size(); ++e) {
    if (touch.readings[e] == Reading::unknown) {
      continue;
    }
    const glm::dvec2& element = touch.elements_mm[e];
    const double log_odds =
        map_.log_odds(T_object_sensor.translation_mm + element.x * along_x + element.y * along_y);
    sum += of(touch.readings[e], log_odds);
  }
  return sum;
}

}  // namespace palpate
