#include "palpate/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

namespace {

void validate(const Touch& touch) {
  const std::size_t e = touch.pressure.size();
  if (touch.elements_mm.size() != e || (!touch.valid.empty() && touch.valid.size() != e)) {
    throw Error(Fault::input,
                fmt::format("touch: {} pressures, {} elements and {} validities; make them agree",
                            e, touch.elements_mm.size(), touch.valid.size()));
  }
  const auto finite = [](const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); };
  if (!finite(touch.T_robot_sensor.translation_mm) ||
      !std::isfinite(touch.T_robot_sensor.theta_rad)) {
    throw Error(Fault::input, "touch: T_robot_sensor is not finite");
  }
  for (std::size_t i = 0; i < e; ++i) {
    const bool alive = touch.valid.empty() || touch.valid[i] != 0;
    if (!finite(touch.elements_mm[i]) || (alive && std::isinf(touch.pressure[i]))) {
      throw Error(Fault::input,
                  fmt::format("touch: element {}: its place or pressure is not finite; mark a dead "
                              "element as not valid",
                              i));
    }
  }
}

}  // namespace

std::vector<Reading> ContactClassifier::classify(const Touch& touch) const {
  validate(touch);
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
