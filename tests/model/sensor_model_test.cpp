#include "palpate/sensor_model.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "palpate/occupancy_grid.hpp"
#include "reference/reference.hpp"
#include "support/errors.hpp"
#include "support/limits.hpp"

namespace palpate::sensor_model_test {

constexpr Reading in = Reading::in_contact;
constexpr Reading no = Reading::no_contact;

TEST(LogOdds, AndProbabilityAreInverse) {
  EXPECT_EQ(log_odds_from_probability(0.5), 0.0);
  EXPECT_DOUBLE_EQ(log_odds_from_probability(0.2), -std::log(4.0));
  EXPECT_EQ(probability_from_log_odds(1000.0), 1.0);
  EXPECT_EQ(probability_from_log_odds(-1000.0), 0.0);
  for (double p = 0.001; p < 1.0; p += 0.037) {
    EXPECT_NEAR(probability_from_log_odds(log_odds_from_probability(p)), p, 1e-15) << "rounding";
  }
}

TEST(InverseSensorModel, IsEquations4To6) {
  for (const double prior : {0.05, 0.2, 0.5, 0.8}) {
    for (const double peak : {0.1, 0.9, 0.999}) {
      for (const double spread_mm : {0.25, 0.5, 2.0}) {
        const InverseSensorModel model{.spread_mm = spread_mm, .peak = peak, .prior = prior};
        // Beyond 4 spreads the reference itself loses digits of log(p / (1 - p)).
        for (double d = 0.0; d < 4.0 * spread_mm; d += 0.1 * spread_mm) {
          for (const Reading reading : {in, no, Reading::unknown}) {
            EXPECT_NEAR(model.increment(reading, d), reference::increment(reading, d, model), 1e-12)
                << "float64 rounding of logs near 10";
          }
        }
      }
    }
  }
}

TEST(InverseSensorModel, ContactAndNoContactMirrorEachOtherAboutAnEvenPrior) {
  const InverseSensorModel low{.spread_mm = 0.5, .peak = 0.9, .prior = 0.1};
  const InverseSensorModel high{.spread_mm = 0.5, .peak = 0.9, .prior = 0.9};
  for (double d = 0.0; d < 3.0; d += 0.2) {
    EXPECT_NEAR(low.increment(in, d), -high.increment(no, d), 1e-14) << "rounding of 1 - prior";
  }
}

TEST(InverseSensorModel, TendsToThePriorFarAway) {
  const InverseSensorModel model;
  for (double d = 0.1; d < 5.0; d += 0.1) {
    EXPECT_LT(model.increment(in, d), model.increment(in, d - 0.1));
    EXPECT_GT(model.increment(in, d), 0.0);
    EXPECT_LT(model.increment(no, d), 0.0);
  }
  EXPECT_EQ(model.increment(in, 1e6), 0.0);
}

TEST(InverseSensorModel, SupportRadiusKeepsTheCutSumBelowTheTolerance) {
  for (const double prior : {0.02, 0.2, 0.5, 0.98}) {
    for (const double peak : {1e-9, 0.3, 0.9, 0.9999}) {
      for (const std::size_t readings : {1U, 36U, 7000U, 1000000U}) {
        const InverseSensorModel model{.spread_mm = 0.7, .peak = peak, .prior = prior};
        const double radius = model.support_radius_mm(readings, 5e-4);
        const auto all = static_cast<double>(readings);
        EXPECT_LE(all * std::abs(model.increment(in, radius)), 5e-4 * (1.0 + 1e-9));
        EXPECT_LE(all * std::abs(model.increment(no, radius)), 5e-4 * (1.0 + 1e-9));
        EXPECT_LE(radius, 10.0 * model.spread_mm) << "cuts off nothing worth the time";
      }
    }
  }
}

TEST(InverseSensorModel, RefusesWhatIsOutOfRange) {
  const auto expect_refused = [](const InverseSensorModel& model, const std::string& field) {
    const std::string said = input_error([&] { model.validate(); });
    EXPECT_TRUE(said.starts_with(field)) << said;
  };
  InverseSensorModel().validate();
  for (const double spread : {0.0, -1.0, nan, infinity}) {
    expect_refused({.spread_mm = spread}, "spread");
  }
  for (const double p : {0.0, 1.0, -0.1, 1.5, nan}) {
    expect_refused({.peak = p}, "peak");
    expect_refused({.prior = p}, "prior");
  }
}

}  // namespace palpate::sensor_model_test
