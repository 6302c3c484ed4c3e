#include "contradiction.hpp"

#include <algorithm>
#include <vector>

#include "palpate/occupancy_grid.hpp"

namespace palpate {

double prior_log_likelihood(const Touch& touch, const ContactClassifier& classifier,
                            const ContactLikelihood& model) {
  const double log_odds = log_odds_from_probability(model.prior);
  const std::vector<Reading> readings = classifier.classify(touch);
  double sum = 0.0;
  for (const Reading reading : {Reading::no_contact, Reading::in_contact}) {
    sum += static_cast<double>(std::count(readings.begin(), readings.end(), reading)) *
           model.log_likelihood(reading, log_odds);
  }
  return sum;
}

}  // namespace palpate
