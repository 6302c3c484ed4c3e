#include "palpate/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "model/contact_readings.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

void require_sound(const Touch& touch) {
  const std::size_t e = touch.pressure.size();
  if (touch.elements_mm.size() != e || (!touch.valid.empty() && touch.valid.size() != e)) {
    throw Error(Fault::input,
                fmt::format("touch: {} pressures, {} elements and {} validities; make them agree",
                            e, touch.elements_mm.size(), touch.valid.size()));
  }
  const auto finite = [](const glm::dvec2& p) { return std::isfinite(p.x) && std::isfinite(p.y); };
  if (!finite(touch.T_robot_sensor.translation_mm) ||
      !std::isfinite(touch.T_robot_sensor.theta_rad)) {
    throw Error(Fault::input, "touch: T_robot_sensor is not finite; give finite numbers");
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

void ContactClassifier::validate() const {
  if (!(threshold >= 0.0) || !std::isfinite(threshold)) {
    throw Error(Fault::input, fmt::format("threshold = {}: give a pressure of at least 0, in the "
                                          "recording's unit",
                                          threshold));
  }
  if (!(ratio >= 0.0 && ratio < 1.0)) {
    throw Error(Fault::input, fmt::format("ratio = {}: must be at least 0 and below 1", ratio));
  }
}

std::vector<Reading> ContactClassifier::classify(const Touch& touch) const {
  return palpate::classify(touch, *this, {});
}

std::vector<Reading> classify(const Touch& touch, const ContactClassifier& classifier,
                              std::vector<Reading> reuse) {
  classifier.validate();
  require_sound(touch);
  const double threshold = classifier.threshold;
  const double ratio = classifier.ratio;
  const std::size_t e = touch.pressure.size();
  const auto alive = [&](std::size_t i) { return touch.valid.empty() || touch.valid[i] != 0; };

  double largest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < e; ++i) {
    if (alive(i)) {
      largest = std::max(largest, touch.pressure[i]);
    }
  }

  std::vector<Reading> readings = std::move(reuse);
  readings.assign(e, Reading::unknown);
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

std::optional<std::string> fault_of(std::span<const ElementReading> readings) {
  for (const ElementReading& reading : readings) {
    const glm::dvec2& p = reading.position_mm;
    if (!(std::abs(p.x) <= farthest_mm && std::abs(p.y) <= farthest_mm)) {
      return fmt::format(
          "an element at [{}, {}] mm; keep touches within {:g} mm of the robot "
          "frame's origin, or check the poses' unit",
          p.x, p.y, farthest_mm);
    }
  }
  return {};
}

}  // namespace palpate
