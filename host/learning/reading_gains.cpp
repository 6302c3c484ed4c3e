#include "reading_gains.hpp"

namespace palpate {

ReadingGains::ReadingGains(const ContactModel& contact, double beyond, std::size_t object) {
  const std::size_t levels = contact.table ? contact.table->levels() : 2;
  gains_.reserve(levels * nodes);
  for (std::size_t level = 0; level < levels; ++level) {
    const auto reading = static_cast<Reading>(level);
    const double nothing = contact.log_likelihood(reading, {beyond}, object);
    for (std::size_t node = 0; node < nodes; ++node) {
      const double value = static_cast<double>(node) / per_nat - largest;
      gains_.push_back(
          static_cast<float>(contact.log_likelihood(reading, {value}, object) - nothing));
    }
  }
}

}  // namespace palpate
