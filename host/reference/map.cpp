#include "reference/reference.hpp"

#include <cmath>
#include <limits>

namespace palpate::reference {

std::vector<Reading> classify(const Touch& touch, const ContactClassifier& classifier) {
  const auto dead = [&](std::size_t i) { return !touch.valid.empty() && touch.valid[i] == 0; };
  double e_max = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < touch.pressure.size(); ++i) {
    if (!dead(i) && touch.pressure[i] > e_max) {
      e_max = touch.pressure[i];
    }
  }
  std::vector<Reading> readings;
  for (std::size_t i = 0; i < touch.pressure.size(); ++i) {
    const double e = touch.pressure[i];  // Eq. 3
    if (!dead(i) && e > classifier.threshold && e > classifier.ratio * e_max) {
      readings.push_back(Reading::in_contact);
    } else if (!dead(i) && e < classifier.threshold && e < classifier.ratio * e_max) {
      readings.push_back(Reading::no_contact);
    } else {
      readings.push_back(Reading::unknown);
    }
  }
  return readings;
}

std::vector<Reading> classify(const Touch& touch, const ContactModel& model) {
  std::vector<Reading> readings = classify(touch, model.classifier);
  if (model.table) {
    for (std::size_t i = 0; i < readings.size(); ++i) {
      if (readings[i] == Reading::in_contact) {
        int level = 1;
        for (const double edge : model.table->level_edges) {
          level += touch.pressure[i] >= edge ? 1 : 0;
        }
        readings[i] = static_cast<Reading>(level);
      }
    }
  }
  return readings;
}

double logit(double p) { return std::log(p / (1.0 - p)); }

double increment(Reading reading, double distance_mm, const InverseSensorModel& sensor) {
  const double m = sensor.prior;
  // Eq. 4, and Eq. 5 within Eq. 6.
  const double g = sensor.peak * std::exp(-distance_mm * distance_mm /
                                          (2.0 * sensor.spread_mm * sensor.spread_mm));
  if (reading == Reading::unknown) {
    return 0.0;
  }
  const double p = reading == Reading::no_contact ? m - m * g : m + (1.0 - m) * g;
  return logit(p) - logit(m);
}

std::vector<double> log_odds_map(std::span<const Touch> touches, const OccupancyGrid& grid,
                                 const ContactClassifier& classifier,
                                 const InverseSensorModel& sensor) {
  std::vector<double> log_odds(static_cast<std::size_t>(grid.nx) * grid.ny, logit(sensor.prior));
  for (const Touch& touch : touches) {
    const std::vector<Reading> readings = classify(touch, classifier);
    for (std::size_t k = 0; k < readings.size(); ++k) {
      const glm::dvec2 element_mm = transform(touch.T_robot_sensor, touch.elements_mm[k]);
      for (int j = 0; j < grid.ny; ++j) {
        for (int i = 0; i < grid.nx; ++i) {
          const double dx = grid.origin_mm.x + grid.cell_mm * i - element_mm.x;
          const double dy = grid.origin_mm.y + grid.cell_mm * j - element_mm.y;
          // Eq. 2 and 6.
          log_odds[static_cast<std::size_t>(j) * grid.nx + i] +=
              increment(readings[k], std::hypot(dx, dy), sensor);
        }
      }
    }
  }
  return log_odds;
}

}  // namespace palpate::reference
