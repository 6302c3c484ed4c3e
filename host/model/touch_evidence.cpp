#include "model/touch_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/bounding_box.hpp"
#include "model/refuse.hpp"

namespace palpate {

namespace {

bool is_known(Reading reading) { return reading != Reading::unknown; }

/// The evidence of the elements whose reading is `kept`.
template <typename Kept>
TouchEvidence evidence_where(TouchEvidence evidence, const Kept& kept) {
  std::size_t n = 0;
  for (std::size_t e = 0; e < evidence.readings.size(); ++e) {
    if (kept(evidence.readings[e])) {
      evidence.elements_mm[n] = evidence.elements_mm[e];
      evidence.readings[n] = evidence.readings[e];
      evidence.lives[n++] = evidence.lives[e];
    }
  }
  evidence.elements_mm.resize(n);
  evidence.readings.resize(n);
  evidence.lives.resize(n);
  return evidence;
}

}  // namespace

std::vector<glm::dvec2> digitacts_array() {
  constexpr double columns_mm[] = {-4.9, -3.0, -1.1, 1.1, 3.0, 4.9};
  std::vector<glm::dvec2> elements;
  elements.reserve(36);
  for (int row = 0; row < 6; ++row) {
    for (const double x : columns_mm) {
      elements.emplace_back(x, (row - 2.5) * 1.9);
    }
  }
  return elements;
}

std::vector<glm::dvec2> grid_array(int columns, int rows, double pitch_mm) {
  std::vector<glm::dvec2> elements;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      elements.emplace_back((column - (columns - 1) / 2.0) * pitch_mm,
                            (row - (rows - 1) / 2.0) * pitch_mm);
    }
  }
  return elements;
}

glm::dvec2 array_centre_mm(std::span<const glm::dvec2> elements_mm) {
  return elements_mm.empty() ? glm::dvec2(0.0) : bounding_box(elements_mm).middle();
}

double array_reach_mm(std::span<const glm::dvec2> elements_mm) {
  const glm::dvec2 centre_mm = array_centre_mm(elements_mm);
  double reach = 0.0;
  for (const glm::dvec2& element : elements_mm) {
    reach = std::max(reach, std::hypot(element.x - centre_mm.x, element.y - centre_mm.y));
  }
  return reach;
}

Touch Recording::touch(std::size_t i) const {
  const std::size_t e = elements();
  const auto of_array = [&](std::size_t count) { return count == e || count == size() * e; };
  if (i >= size() || pressure.size() != size() * e || !of_array(elements_mm.size()) ||
      !(valid.empty() || of_array(valid.size()))) {
    refuse("recording",
           "touch {} of {} poses, {} pressures, {} elements and {} valid; make them agree", i,
           size(), pressure.size(), elements_mm.size(), valid.size());
  }
  // An array that changes, or elements that die on the way, have a row per touch.
  const auto row = [&](const auto& values) {
    return std::span(values).subspan(values.size() == e ? 0 : i * e, e);
  };
  return {.T_robot_sensor = T_robot_sensor[i],
          .elements_mm = row(elements_mm),
          .pressure = std::span(pressure).subspan(i * e, e),
          .valid = valid.empty() ? std::span<const std::uint8_t>{} : row(valid)};
}

std::vector<Touch> Recording::touches(std::size_t begin, std::size_t end) const {
  std::vector<Touch> views;
  views.reserve(std::min(end - begin, size()));
  for (std::size_t i = begin; i < end; ++i) {
    views.push_back(touch(i));
  }
  return views;
}

void TouchEvidence::assign(const Touch& touch, const ContactModel& contact) {
  readings = classify(touch, contact, std::move(readings));
  T_robot_sensor = touch.T_robot_sensor;
  elements_mm.assign(touch.elements_mm.begin(), touch.elements_mm.end());
  lives.assign(readings.size(), 0);
  contacts = static_cast<std::size_t>(std::ranges::count_if(readings, is_contact));
  least_pressure = std::numeric_limits<double>::infinity();
  largest_pressure = -least_pressure;
  force = 0.0;
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if (!is_living(touch, e)) {
      continue;
    }
    const double pressure = touch.pressure[e];
    lives[e] = 1;
    least_pressure = std::min(least_pressure, pressure);
    largest_pressure = std::max(largest_pressure, pressure);
    force += pressure > 0.0 ? pressure / contact.classifier.threshold : 0.0;
  }
}

bool TouchEvidence::tells() const { return std::ranges::any_of(readings, is_known); }

TouchEvidence TouchEvidence::known() const { return evidence_where(*this, is_known); }

TouchEvidence TouchEvidence::contact() const { return evidence_where(*this, is_contact); }

bool is_living(const Touch& touch, std::size_t element) {
  return (touch.valid.empty() || touch.valid[element] != 0) && !std::isnan(touch.pressure[element]);
}

std::vector<TouchEvidence> evidence_of(std::span<const Touch> touches,
                                       const ContactModel& contact) {
  std::vector<TouchEvidence> evidence;
  evidence_of(touches, contact, evidence);
  return evidence;
}

std::span<const TouchEvidence> evidence_of(std::span<const Touch> touches,
                                           const ContactModel& contact,
                                           std::vector<TouchEvidence>& room, std::size_t first) {
  room.resize(std::max(room.size(), first + touches.size()));
  for (std::size_t i = 0; i < touches.size(); ++i) {
    room[first + i].assign(touches[i], contact);
  }
  return std::span(room).subspan(first, touches.size());
}

}  // namespace palpate
