#include "learning/press_checks.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "model/elements_that.hpp"
#include "palpate/error.hpp"

namespace palpate {

void require_poses_of_one_kind(const std::vector<Press>& presses) {
  for (const Press& press : presses) {
    if (press.T_object_robot.has_value() != presses.front().T_object_robot.has_value()) {
      throw Error(Fault::input,
                  fmt::format("{}: its pose is {}known, unlike that of {}; calibrate "
                              "from one kind",
                              press.name, press.T_object_robot ? "" : "un", presses.front().name));
    }
  }
}

std::vector<std::string> leave_out_unknown(std::vector<Press>& presses,
                                           const ContactClassifier& classifier) {
  std::string first;
  const std::size_t left_out = std::erase_if(presses, [&](const Press& press) {
    const bool unknown = std::ranges::all_of(press.touches, [&](const Touch& touch) {
      return known_readings(touch, classifier).empty();
    });
    first = unknown && first.empty() ? press.name : first;
    return unknown;
  });
  if (presses.empty()) {
    throw Error(Fault::input, fmt::format("{}: all elements are Unknown, as in all other touches: "
                                          "dead, without a number, or of the same pressure",
                                          first));
  }
  if (left_out == 0) {
    return {};
  }
  return {fmt::format(
      "{}: all elements are Unknown: dead, without a number, or of the same "
      "pressure; left out{}",
      first, left_out > 1 ? fmt::format(", with {} more such touches", left_out - 1) : "")};
}

std::vector<std::string> stuck_elements(const std::vector<Press>& presses,
                                        const ContactClassifier& classifier) {
  constexpr std::size_t fewest_touches = 5;
  constexpr double rare = 0.01;  // of the readings In Contact of all other elements
  std::map<std::size_t, std::vector<const Touch*>> arrays;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      arrays[touch.pressure.size()].push_back(&touch);
    }
  }
  const std::vector<double> contacts = contact_pressures(presses, classifier);
  std::vector<std::string> warnings;
  for (const auto& [elements, touches] : arrays) {
    std::vector<std::size_t> stuck;
    for (std::size_t e = 0; touches.size() >= fewest_touches && e < elements; ++e) {
      const double pressure = touches.front()->pressure[e];
      const bool same = std::ranges::all_of(touches, [&](const Touch* touch) {
        return (touch->valid.empty() || touch->valid[e] != 0) && touch->pressure[e] == pressure;
      });
      if (!same || !(pressure > classifier.threshold)) {
        continue;
      }
      const auto [first, last] = std::equal_range(contacts.begin(), contacts.end(), pressure);
      const double others = static_cast<double>(last - first) - static_cast<double>(touches.size());
      if (others <= rare * static_cast<double>(contacts.size() - touches.size())) {
        stuck.push_back(e);
      }
    }
    if (!stuck.empty()) {
      warnings.push_back(
          fmt::format("{} the same pressure above the threshold in all {} touches: "
                      "it counts as in contact, and seems stuck; set 'valid' to 0 "
                      "there",
                      elements_that(stuck, "reads", "read"), touches.size()));
    }
  }
  return warnings;
}

}  // namespace palpate
