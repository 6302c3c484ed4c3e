#include "learning/held_out.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "model/random.hpp"

namespace palpate::held_out_test {

TEST(ClearlyLess, IsByMoreThanTwoStandardErrors) {
  // Differences one above and one below their mean in turn: a standard error of 1 / sqrt(n - 1).
  const auto losses = [](double mean, int n) {
    std::vector<double> of_each;
    for (int i = 0; i < n; ++i) {
      of_each.push_back(10.0 - mean + (i % 2 == 0 ? 1.0 : -1.0));
    }
    return of_each;
  };
  const std::vector<double> same(100, 10.0);
  const auto clearly_less = [](const std::vector<double>& a, const std::vector<double>& b) {
    return difference_of(a, b).is_clear();
  };
  EXPECT_TRUE(clearly_less(losses(2.0, 100), same));
  EXPECT_TRUE(clearly_less(losses(0.21, 100), same));
  EXPECT_FALSE(clearly_less(losses(0.19, 100), same)) << "within two standard errors of 0.1005";
  EXPECT_FALSE(clearly_less(losses(-2.0, 100), same));
  EXPECT_FALSE(clearly_less(same, same));
}

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

constexpr FitScale scale{.mean = 0.9, .sd = 1.4, .shared_sd = 0.1};

using Fits = std::map<std::size_t, std::vector<StrangerFit>>;

std::optional<double> sd_of(const Fits& fits) { return with_strangers(fits, scale).stranger_sd; }

/// Fits of one object that is left out, drawn as wide as the model says, one in ten of them wider.
struct Drawn {
  std::size_t label = 0;
  int count = 0;
  std::size_t touches = 3;
  double stranger_sd = 4.0;
};

Fits fits_of(const std::vector<Drawn>& strangers) {
  Random random(7, Stream::readings);
  Fits fits;
  for (const auto& [label, count, touches, stranger_sd] : strangers) {
    const auto n = static_cast<double>(touches);
    const double spread = std::hypot(scale.sd, std::sqrt(n) * scale.shared_sd);
    for (int i = 0; i < count; ++i) {
      const double own_sd = random.uniform() < 0.1 ? 5.0 : 1.0;
      const double z = std::hypot(own_sd, stranger_sd * (n - 1.0)) * random.normal();
      fits[label].push_back({{.z = scale.mean * std::sqrt(n) + z * spread}, touches});
    }
  }
  return fits;
}

TEST(WithStrangers, FindsTheSdByWhichFitsWereDrawn) {
  for (const double truth : {1.5, 3.0, 6.0}) {
    const Fits fits = fits_of({{0, 300, 3, truth},
                               {1, 300, 3, truth},
                               {2, 300, 3, truth},
                               {0, 100, 2, truth},
                               {1, 100, 2, truth},
                               {2, 100, 2, truth}});
    EXPECT_NEAR(sd_of(fits).value(), truth, 0.1 * truth);
  }
}

TEST(WithStrangers, FindsWhatSingleTouchesAreLike) {
  Random random(8, Stream::readings);
  const double spread = std::hypot(scale.sd, scale.shared_sd);
  for (const SingleFitScale& truth : {SingleFitScale{0.0, 1.0}, SingleFitScale{-6.0, 3.0}}) {
    Fits fits;
    for (int i = 0; i < 900; ++i) {
      const double z = truth.mean + truth.sd * random.normal();
      fits[i % 3].push_back({{.z = scale.mean + spread * z}, 1});
    }
    const FitScale found = with_strangers(fits, scale);
    ASSERT_TRUE(found.stranger_single_touch);
    EXPECT_NEAR(found.stranger_single_touch->mean, truth.mean, 0.5);
    EXPECT_NEAR(found.stranger_single_touch->sd, truth.sd, 0.15 * truth.sd);
    EXPECT_FALSE(found.stranger_sd) << "of single touches alone";
    fits.erase(2);
    EXPECT_FALSE(with_strangers(fits, scale).stranger_single_touch) << "of two objects";
  }
}

TEST(WithStrangers, OfFewerThanThreeObjectsOrFiveGroupsIsNone) {
  EXPECT_FALSE(sd_of({}));
  EXPECT_FALSE(sd_of(fits_of({{0, 300}, {1, 300}})));
  EXPECT_FALSE(sd_of(fits_of({{0, 300}, {1, 300}, {2, 4}, {2, 20, 1}})))
      << "of four groups, and of single touches";
  EXPECT_TRUE(sd_of(fits_of({{0, 300}, {1, 300}, {2, 5}, {2, 20, 1}})));
}

TEST(WithStrangers, CountsObjectsAlikeHoweverOftenTheyWereTouched) {
  const auto sd = [](int of_first) {
    return sd_of(fits_of({{0, of_first, 3, 2.0}, {1, 200, 3, 8.0}, {2, 200, 3, 8.0}})).value();
  };
  EXPECT_NEAR(sd(4000), sd(200), 0.15 * sd(200));
}

TEST(WithStrangers, StaysWithinAQuarterAndFourTimesPalpatesOwn) {
  EXPECT_EQ(sd_of(fits_of({{0, 50, 3, 0.0}, {1, 50, 3, 0.0}, {2, 50, 3, 0.0}})), 1.0);
  const std::vector<StrangerFit> unlike(50, {{.z = -largest_fit_z}, 2});
  EXPECT_NEAR(sd_of({{0, unlike}, {1, unlike}, {2, unlike}}).value(), 16.0, 1.0);
}

}  // namespace palpate::held_out_test
