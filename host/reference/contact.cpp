#include "reference.hpp"

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

}  // namespace palpate::reference
