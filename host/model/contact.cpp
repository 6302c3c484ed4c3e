#include "palpate/contact.hpp"

#include <algorithm>
#include <limits>

namespace palpate {

std::vector<Reading> ContactClassifier::classify(const Touch& touch) const {
  const std::size_t e = touch.pressure.size();
  const auto alive = [&](std::size_t i) { return touch.valid.empty() || touch.valid[i] != 0; };

  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < e; ++i) {
    if (alive(i)) {
      largest = std::max(largest, touch.pressure[i]);
    }
  }

  std::vector<Reading> readings(e, Reading::unknown);
  for (std::size_t i = 0; i < e; ++i) {
    if (!alive(i)) {
      continue;
    }
    const double pressure = touch.pressure[i];
    if (pressure > threshold && pressure > ratio * largest) {
      readings[i] = Reading::in_contact;
    } else if (pressure < threshold && pressure < ratio * largest) {
      readings[i] = Reading::no_contact;
    }
  }
  return readings;
}

std::vector<ElementReading> known_readings(const Touch& touch,
                                           const ContactClassifier& classifier) {
  const std::vector<Reading> readings = classifier.classify(touch);
  std::vector<ElementReading> known;
  known.reserve(readings.size());
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (readings[i] != Reading::unknown) {
      known.push_back({touch.T_robot_sensor * touch.elements_mm[i], readings[i]});
    }
  }
  return known;
}

}  // namespace palpate
