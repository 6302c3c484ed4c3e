#include "reference/reference.hpp"

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

}  // namespace palpate::reference
