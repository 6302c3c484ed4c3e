#include "model/predicted_readings.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "palpate/touch.hpp"
#include "support/synthetic.hpp"

namespace palpate::predicted_readings_test {

TEST(PredictedReadings, AreTheContactModels) {
  const Pose T_object_sensor{{1.0, -2.0}, 0.4};
  const std::vector<glm::dvec2> elements_mm = digitacts_array();
  for (const double steepness : {0.0, 1.0, 30.0, 1000.0}) {
    const OccupancyGrid map = random_map(33, 21, 0.5, steepness, 3);
    for (const double gamma : {0.0, 1e-9, 0.1, 0.9}) {
      const ContactModel model{.gamma = gamma, .prior = 0.2};
      const InterpolatedMap interpolated(map, *model.prior);
      const std::vector<double> logs =
          reading_log_likelihoods(elements_mm, T_object_sensor, interpolated, model, 0);
      ASSERT_EQ(logs.size(), 2 * elements_mm.size());
      for (std::size_t i = 0; i < logs.size(); ++i) {
        const MapSample sample{interpolated.log_odds(T_object_sensor * elements_mm[i / 2])};
        const double expected = model.log_likelihood(static_cast<Reading>(i % 2), sample, 0);
        // Two ways of rounding: places by 1e-15 mm, at slopes of up to 4,000 nats/mm.
        EXPECT_NEAR(logs[i], expected, 1e-10 * std::max(1.0, std::abs(expected)));
      }
    }
  }
}

}  // namespace palpate::predicted_readings_test
