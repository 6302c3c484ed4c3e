#include "displaced_touches.hpp"

#include <cmath>

#include "predicted_readings.hpp"

namespace palpate {

LivingElements::LivingElements(const Touch& touch, const ContactModel& contact)
    : T_robot_sensor(touch.T_robot_sensor) {
  const std::vector<Reading> readings = contact.classify(touch);
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if ((touch.valid.empty() || touch.valid[e] != 0) && !std::isnan(touch.pressure[e])) {
      largest = std::max(largest, touch.pressure[e]);
      elements.push_back({touch.elements_mm[e], readings[e] == Reading::unknown
                                                    ? reading_levels(contact)
                                                    : static_cast<std::size_t>(readings[e])});
    }
  }
}

BorderedLogOdds::BorderedLogOdds(const OccupancyGrid& map, const ContactModel& contact)
    : first_mm_(map.origin_mm - glm::dvec2(map.cell_mm)),
      cell_mm_(map.cell_mm),
      columns_(map.nx + 2),
      rows_(map.ny + 2),
      log_odds_(static_cast<std::size_t>(columns_) * rows_,
                static_cast<float>(log_odds_from_probability(contact.prior.value()))) {
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      log_odds_[static_cast<std::size_t>(j + 1) * columns_ + i + 1] = map.at(i, j);
    }
  }
}

}  // namespace palpate
