#include "estimation/lattice/reading_predictor.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "model/interpolated_map.hpp"
#include "model/predicted_readings.hpp"
#include "support/synthetic.hpp"

namespace palpate::reading_predictor_test {

/// Largest difference in nats from the normalised log-likelihoods, over random poses.
double largest_error(const ContactModel& contact) {
  const std::vector<Hypothesis> objects{{random_map(31, 27, 0.5, 6.0, 81)},
                                        {random_map(14, 15, 1.0, 6.0, 83)}};
  const ReadingPredictor predictor(objects, contact);
  const std::vector<glm::dvec2> elements = digitacts_array();
  const std::size_t levels = predictor.levels();
  Uniform uniform(11);
  double largest = 0.0;
  constexpr std::size_t stride = 3;
  std::vector<float> logs(elements.size() * levels * stride);
  for (int trial = 0; trial < 50; ++trial) {
    const std::size_t object = static_cast<std::size_t>(trial) % objects.size();
    // Some elements lie beyond the maps, and some of these far beyond.
    const double reach = trial % 10 == 9 ? 1e8 : 12.0;
    const Pose T_object_sensor{{uniform(-reach, reach), uniform(-reach, reach)}, uniform(-4, 4)};
    predictor.predict(object, T_object_sensor, elements, logs, stride);
    const InterpolatedMap map(objects[object].map, *contact.prior);
    const std::vector<double> expected =
        reading_log_likelihoods(elements, T_object_sensor, map, contact, object);
    for (std::size_t e = 0; e < elements.size(); ++e) {
      double sum = 0.0;
      for (std::size_t level = 0; level < levels; ++level) {
        sum += std::exp(expected[e * levels + level]);
      }
      for (std::size_t level = 0; level < levels; ++level) {
        const double predicted = logs[(e * levels + level) * stride];
        largest =
            std::max(largest, std::abs(predicted - expected[e * levels + level] + std::log(sum)));
      }
    }
  }
  return largest;
}

TEST(ReadingPredictor, AgreesWithTheContactModel) {
  for (const double gamma : {0.0, 0.1, 0.9}) {
    // Straight lines between the table's nodes, and places in float32 of a cell.
    EXPECT_LT(largest_error({.gamma = gamma, .prior = 0.2}), 2e-4) << gamma;
  }
}

TEST(ReadingPredictor, KnowsTheLevelsOfATableAndItsObjects) {
  // Nodes one nat apart are nodes of the predictor's table too.
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

}  // namespace palpate::reading_predictor_test
