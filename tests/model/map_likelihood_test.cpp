#include "model/map_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "model/contact_readings.hpp"
#include "palpate/touch.hpp"
#include "support/synthetic.hpp"

namespace palpate::map_likelihood_test {

TEST(MapLikelihood, OfAllReadingsIsTheContactModels) {
  const Pose T_object_sensor{{1.0, -2.0}, 0.4};
  const std::vector<glm::dvec2> elements_mm = digitacts_array();
  for (const double steepness : {0.0, 1.0, 30.0, 1000.0}) {
    const OccupancyGrid map = random_map(33, 21, 0.5, steepness, 3);
    for (const double gamma : {0.0, 1e-9, 0.1, 0.9}) {
      const ContactModel model{.gamma = gamma, .prior = 0.2};
      const MapLikelihood likelihood(map, model);
      std::vector<double> logs(2 * elements_mm.size());
      likelihood.all_readings(elements_mm, T_object_sensor, logs);
      for (std::size_t i = 0; i < logs.size(); ++i) {
        const double log_odds = likelihood.log_odds(T_object_sensor * elements_mm[i / 2]);
        const double expected = model.log_likelihood(static_cast<Reading>(i % 2), {log_odds});
        // Two ways of rounding: places by 1e-15 mm, at slopes of up to 4,000 nats/mm.
        EXPECT_NEAR(logs[i], expected, 1e-10 * std::max(1.0, std::abs(expected)));
      }
    }
  }
}

/// Largest difference in nats of predictive() from the normalised log-likelihoods, over random
/// poses.
double largest_error(const ContactModel& contact) {
  const std::vector<OccupancyGrid> maps{random_map(31, 27, 0.5, 6.0, 81),
                                        random_map(14, 15, 1.0, 6.0, 83)};
  const ContactModel model = predictive(contact);
  const std::vector<glm::dvec2> elements = digitacts_array();
  Uniform uniform(11);
  double largest = 0.0;
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t object = static_cast<std::size_t>(trial) % maps.size();
    // Some elements lie beyond the maps, and some of these far beyond.
    const double reach = trial % 10 == 9 ? 1e8 : 12.0;
    const Pose T_object_sensor{{uniform(-reach, reach), uniform(-reach, reach)}, uniform(-4, 4)};
    const MapLikelihood likelihood(maps[object], contact, object);
    const std::size_t levels = likelihood.levels();
    std::vector<double> logs(elements.size() * levels);
    MapLikelihood(maps[object], model, object).all_readings(elements, T_object_sensor, logs);
    std::vector<double> expected(logs.size());
    likelihood.all_readings(elements, T_object_sensor, expected);
    for (std::size_t e = 0; e < elements.size(); ++e) {
      double sum = 0.0;
      for (std::size_t level = 0; level < levels; ++level) {
        sum += std::exp(expected[e * levels + level]);
      }
      for (std::size_t i = e * levels; i < (e + 1) * levels; ++i) {
        largest = std::max(largest, std::abs(logs[i] - expected[i] + std::log(sum)));
      }
    }
  }
  return largest;
}

TEST(Predictive, AgreesWithTheContactModel) {
  for (const double gamma : {0.0, 0.1, 0.9}) {
    EXPECT_LT(largest_error({.gamma = gamma, .prior = 0.2}), 2e-4) << gamma;
  }
}

TEST(Predictive, KnowsTheLevelsOfATableAndItsObjects) {
  // Nodes one nat apart are nodes of the predictive table too.
  LikelihoodTable table{.first_log_odds = -8.0,
                        .last_log_odds = 8.0,
                        .nodes = 17,
                        .level_edges = {3.0, 5.0},
                        .log_likelihood = {}};
  Uniform uniform(12);
  for (int i = 0; i < 2 * 4 * 17; ++i) {
    table.log_likelihood.push_back(uniform(-4.0, 0.0));
  }
  // Levels' slopes differ by up to 8, so the curvature of their log-sum is at most 16: times the
  // square of a step of 1/32 nats, over 8.
  EXPECT_LT(largest_error({.prior = 0.2, .table = table}), 2e-3);
}

}  // namespace palpate::map_likelihood_test
