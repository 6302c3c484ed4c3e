#include "press_readings.hpp"

#include <algorithm>
#include <cmath>

#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace palpate {

namespace {

/// An element on the lattice.
struct Node {
  int x = 0;
  int y = 0;
  std::size_t level = 0;
};

std::vector<ReadingRun> runs_of(std::vector<Node> nodes) {
  std::ranges::sort(nodes, [](const Node& a, const Node& b) {
    return a.y != b.y ? a.y < b.y : a.x != b.x ? a.x < b.x : a.level < b.level;
  });
  std::vector<ReadingRun> runs;
  for (const Node& node : nodes) {
    if (!runs.empty()) {
      ReadingRun& last = runs.back();
      if (last.level == node.level && last.y == node.y && last.x + last.length == node.x) {
        ++last.length;
        continue;
      }
    }
    runs.push_back({node.level, node.x, node.y, 1});
  }
  return runs;
}

}  // namespace

PressReadings::PressReadings(const Touch& touch, const ContactModel& contact, bool mirrored,
                             double step_mm) {
  const std::vector<Reading> readings = contact.classify(touch);
  for (std::size_t e = 0; e < readings.size(); ++e) {
    if (readings[e] == Reading::unknown) {
      continue;
    }
    const glm::dvec2& p = touch.elements_mm[e];
    elements_mm.emplace_back(mirrored ? -p.x : p.x, p.y);
    levels.push_back(static_cast<std::uint8_t>(readings[e]));
    if (is_contact(readings[e])) {
      contact_box.take_in(elements_mm.back());
      centre_mm += elements_mm.back();
      ++contacts;
    }
  }
  if (elements_mm.empty()) {
    return;
  }
  first_mm = elements_mm.front();
  std::vector<Node> on_lattice;
  for (std::size_t e = 0; e < elements_mm.size(); ++e) {
    const glm::dvec2 node = glm::round((elements_mm[e] - first_mm) / step_mm);
    nodes.take_in(node);
    on_lattice.push_back({static_cast<int>(node.x), static_cast<int>(node.y), levels[e]});
  }
  runs = runs_of(std::move(on_lattice));
  if (contacts > 0) {
    centre_mm /= static_cast<double>(contacts);
    for (std::size_t e = 0; e < elements_mm.size(); ++e) {
      if (is_contact(static_cast<Reading>(levels[e]))) {
        const glm::dvec2 d = elements_mm[e] - centre_mm;
        reach_mm += glm::dot(d, d) / static_cast<double>(contacts);
      }
    }
    reach_mm = std::sqrt(reach_mm);
  }
}

double displacement_mm(const PressReadings& press, const Pose& T_object_sensor, const Pose& other) {
  const glm::dvec2 d = T_object_sensor * press.centre_mm - other * press.centre_mm;
  const double turned = 1.0 - std::cos(T_object_sensor.theta_rad - other.theta_rad);
  return std::sqrt(glm::dot(d, d) + 2.0 * press.reach_mm * press.reach_mm * turned);
}

}  // namespace palpate
