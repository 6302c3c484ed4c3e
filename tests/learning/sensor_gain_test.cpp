#include "learning/held_out.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace palpate::sensor_gain_test {

/// Presses whose label has this loss, and groups with these pose errors.
std::vector<HeldOut> validation(const std::vector<double>& losses,
                                const std::vector<double>& errors_mm) {
  std::vector<HeldOut> made;
  for (const double loss : losses) {
    const double right = std::exp(-loss);
    made.push_back({.log_evidence = {-loss, std::log(1.0 - right)}});
  }
  for (const double error_mm : errors_mm) {
    made.push_back({.half = 0, .log_evidence = {0.0, -1.0}, .error_mm = error_mm});
  }
  return made;
}

/// 100 values near this one.
std::vector<double> about(double value) {
  std::vector<double> values;
  for (int k = 0; k < 100; ++k) {
    values.push_back(value * (1.0 + 0.01 * (k % 7)));
  }
  return values;
}

TEST(SensorGain, IsBetterWhereTouchesAreToldApartAndPlacedNearer) {
  const auto found =
      gain_of(validation(about(0.9), about(0.3)), validation(about(0.7), about(0.2)));
  EXPECT_TRUE(found.better);
  EXPECT_NEAR(found.less_loss.mean, found.log_loss_before - found.log_loss, 1e-9);
  EXPECT_GT(found.less_loss.standard_error, 0.0);
  EXPECT_LT(2.0 * found.less_loss.standard_error, found.less_loss.mean);
  EXPECT_NEAR(found.less_error.mean, std::log(1.5), 1e-9);
  EXPECT_NEAR(found.log_loss_before / found.log_loss, 9.0 / 7.0, 1e-9);
  EXPECT_NEAR(*found.error_mm_before / *found.error_mm, 1.5, 1e-9);
}

TEST(SensorGain, IsNotBetterWhereNothingOrTheOneIsGainedForTheOther) {
  const std::vector<HeldOut> eq7 = validation(about(0.9), about(0.3));
  EXPECT_FALSE(gain_of(eq7, eq7).gains);
  EXPECT_FALSE(gain_of(eq7, validation(about(0.7), about(0.4))).better) << "places";
  EXPECT_TRUE(gain_of(eq7, validation(about(0.7), about(0.4))).gains);
  EXPECT_FALSE(gain_of(eq7, validation(about(1.0), about(0.2))).better) << "identities";
  EXPECT_TRUE(gain_of(eq7, validation(about(0.91), about(0.2))).better) << "hardly a loss";
  std::vector<double> errors_mm = about(0.2);
  errors_mm[5] = 20.0;  // more than all the others gain together
  EXPECT_TRUE(gain_of(eq7, validation(about(0.7), errors_mm)).better)
      << "a group at another place outweighs no ten better ones";
}

TEST(SensorGain, IsToldByIdentitiesAloneWithoutGroups) {
  const std::vector<HeldOut> eq7 = validation(about(0.9), {});
  const SensorGain found = gain_of(eq7, validation(about(0.7), {}));
  EXPECT_TRUE(found.better);
  EXPECT_FALSE(found.error_mm);
  EXPECT_FALSE(gain_of(eq7, eq7).better);
}

}  // namespace palpate::sensor_gain_test
