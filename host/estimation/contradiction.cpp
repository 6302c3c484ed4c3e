#include "estimation/contradiction.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

double prior_log_likelihood(Reading reading, const ContactModel& model) {
  const MapSample prior{.log_odds = log_odds_from_probability(model.prior.value())};
  const std::size_t sets = model.table ? model.table->sets() : 1;
  double most = -std::numeric_limits<double>::infinity();
  for (std::size_t set = 0; set < sets; ++set) {
    most = std::max(most, model.log_likelihood(reading, prior, set));
  }
  double sum = 0.0;
  for (std::size_t set = 0; set < sets; ++set) {
    sum += std::exp(model.log_likelihood(reading, prior, set) - most);
  }
  return most + std::log(sum / static_cast<double>(sets));
}

double prior_log_likelihood(const ReadingCounts& counts, const ContactModel& model) {
  double sum = 0.0;
  for (std::size_t reading = 0; reading < counts.size(); ++reading) {
    if (counts[reading] > 0) {
      sum += static_cast<double>(counts[reading]) *
             prior_log_likelihood(static_cast<Reading>(reading), model);
    }
  }
  return sum;
}

}  // namespace palpate
