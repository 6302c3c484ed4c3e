#include "learning/held_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "learning/local_search.hpp"
#include "palpate/error.hpp"
#include "simulated_presses.hpp"

namespace palpate::temperature_fit_test {

/// Presses whose labels are drawn with the probabilities that their log evidences, divided by
/// `temperature`, say together with `weight` times their log densities.
std::vector<HeldOut> drawn_presses(std::size_t count, double temperature, double weight,
                                   std::uint64_t seed) {
  Uniform random(seed);
  std::vector<HeldOut> presses;
  for (std::size_t i = 0; i < count; ++i) {
    HeldOut press{.fold = i % 5};
    for (int label = 0; label < 5; ++label) {
      press.log_evidence.push_back(-900.0 + 2.0 * temperature * normal(random));
      press.log_density.push_back(3.0 * normal(random));
    }
    std::vector<double> p = log_probabilities(press, temperature, weight);
    std::ranges::transform(p, p.begin(), [](double nats) { return std::exp(nats); });
    double at = random(0.0, 1.0);
    while (press.truth + 1 < p.size() && at >= p[press.truth]) {
      at -= p[press.truth++];
    }
    presses.push_back(press);
  }
  return presses;
}

TEST(TemperatureFit, RecoversTheTemperatureOfAnOverconfidentModel) {
  const std::vector<HeldOut> presses = drawn_presses(1000, 30.0, 0.5, 1);
  const TemperatureFit fit = fit_temperature(presses);
  EXPECT_NEAR(fit.temperature, 30.0, 2.8);  // 1000 presses tell it within 4 %
  EXPECT_NEAR(fit.feature_weight, 0.5, 0.07);
  const Scores before = scores_of(presses, 1.0);
  const Scores after = scores_of(presses, fit.temperature, fit.feature_weight);
  EXPECT_GT(before.log_loss, 5.0);
  EXPECT_GT(before.calibration_error, 0.2);
  EXPECT_LT(after.log_loss, 0.8);
  EXPECT_LT(after.calibration_error, 0.04);
  EXPECT_EQ(after.records, 1000U);
}

TEST(TemperatureFit, GivesFeaturesAWeightOfTwoAtMostAndNoneWhereTheySayNothing) {
  EXPECT_NEAR(fit_temperature(drawn_presses(500, 1.0, 5.0, 4)).feature_weight, 2.0, 0.01);
  std::vector<HeldOut> presses = drawn_presses(1000, 10.0, 0.0, 3);
  EXPECT_NEAR(fit_temperature(presses).feature_weight, 0.0, 0.07);
  presses[3].log_density.clear();  // of a press without features
  const TemperatureFit fit = fit_temperature(presses);
  EXPECT_EQ(fit.feature_weight, 0.0);
  EXPECT_NEAR(fit.temperature, 10.0, 1.0);
}

/// Presses of folds that both the evidence, by 200 nats, and the features, by 50 nats, tell apart.
std::vector<HeldOut> presses_told_apart_by_both() {
  std::vector<HeldOut> presses;
  for (std::size_t i = 0; i < 20; ++i) {
    presses.push_back({.truth = 0,
                       .fold = i % 5,
                       .log_evidence = {-100.0, -300.0},
                       .log_density = {-4.0, -54.0}});
  }
  return presses;
}

TEST(TemperatureFit, LeavesTheEvidenceItsSayWhereFeaturesTellAllPressesApart) {
  const TemperatureFit fit = fit_temperature(presses_told_apart_by_both());
  EXPECT_NEAR(fit.temperature, 200.0 / std::log(41.0), 2.0) << "as by the evidence alone";
  // With x nats from 50 w, 20 / (1 + 41 e^x) = 1 / (1 + e^-x) - 1 / 2.
  EXPECT_NEAR(50.0 * fit.feature_weight, 0.93, 0.1);
  // Lighter presses turn the features round twice as far; the shape still tells.
  const HeldOut lighter{
      .truth = 0, .log_evidence = {-100.0, -300.0}, .log_density = {-154.0, -54.0}};
  EXPECT_GT(log_probabilities(lighter, fit.temperature, fit.feature_weight)[0], std::log(0.5));
}

TEST(TemperatureFit, GivesFeaturesNoWeightThatOtherTimesDoNotBearOut) {
  std::vector<HeldOut> presses = presses_told_apart_by_both();
  for (HeldOut& press : presses) {
    press.fold = 0;
  }
  EXPECT_EQ(fit_temperature(presses).feature_weight, 0.0) << "there is one time alone";
  // Features that tell four folds apart by little, and mislead by far in the fifth.
  presses = presses_told_apart_by_both();
  for (HeldOut& press : presses) {
    press.log_evidence = {0.0, -2.0};
    press.log_density = press.fold == 4 ? std::vector{-60.0, 0.0} : std::vector{0.0, -3.0};
  }
  EXPECT_EQ(fit_temperature(presses).feature_weight, 0.0);
}

TEST(TemperatureFit, StaysFiniteWhereAllPressesAreToldApartOrEvidenceIsNoGuide) {
  // With b = 200 / T, 20 log(1 + e^-b) + b / 2 + log(1 + e^-b) is least where 21 / (1 + e^b) = 1/2.
  const HeldOut apart{.truth = 0, .log_evidence = {-100.0, -300.0}};
  EXPECT_NEAR(fit_temperature(std::vector(20, apart)).temperature, 200.0 / std::log(41.0), 2.0);
  const HeldOut without_map{.truth = 0, .log_evidence = {-100.0, -300.0, -INFINITY}};
  const std::vector<HeldOut> presses(20, without_map);
  EXPECT_NEAR(fit_temperature(presses).temperature, 200.0 / std::log(41.0), 2.0);
  EXPECT_EQ(log_probabilities(without_map, 30.0)[2], -INFINITY);
  EXPECT_LT(scores_of(presses, 30.0).log_loss, 0.01);
  std::vector<HeldOut> no_guide(40, apart);
  for (std::size_t i = 1; i < no_guide.size(); i += 2) {
    no_guide[i].truth = 1;
  }
  EXPECT_GT(fit_temperature(no_guide).temperature, 1e4);
}

/// Groups of touches whose labels are drawn at a temperature of their number.
std::vector<HeldOut> drawn_groups(std::size_t count, std::size_t touches, double temperature,
                                  std::uint64_t seed) {
  std::vector<HeldOut> groups = drawn_presses(count, temperature, 0.0, seed);
  for (HeldOut& group : groups) {
    group.touches = touches;
    group.log_density.clear();
  }
  return groups;
}

/// Presses with the groups of either half.
std::vector<HeldOut> with_groups(std::vector<HeldOut> presses, const std::vector<HeldOut>& first,
                                 const std::vector<HeldOut>& second) {
  for (const auto& [half, groups] : {std::pair{0U, &first}, {1U, &second}}) {
    for (HeldOut group : *groups) {
      group.half = half;
      presses.push_back(std::move(group));
    }
  }
  return presses;
}

/// A group of three touches that tell it apart from four other labels for certain.
HeldOut apart_in_five() {
  return {.truth = 0, .touches = 3, .log_evidence = {0.0, -300.0, -300.0, -300.0, -300.0}};
}

TEST(TemperatureFit, GrowsAsGroupsOfTouchesNeed) {
  const TemperatureFit fit =
      fit_temperature(with_groups(drawn_groups(1000, 1, 10.0, 9), drawn_groups(1000, 3, 24.0, 7),
                                  drawn_groups(1000, 4, 31.0, 8)));
  EXPECT_NEAR(fit.temperature, 10.0, 1.0);
  EXPECT_NEAR(fit.growth, 7.0, 1.0);
  EXPECT_NEAR(fit.temperature_after(3), 24.0, 2.4);
  EXPECT_EQ(fit.temperature_after(1), fit.temperature);
}

TEST(TemperatureFit, DoesNotGrowWhereTouchesAreIndependentOrAllToldApart) {
  const std::vector<HeldOut> presses = drawn_groups(1000, 1, 10.0, 9);
  const auto growth = [&](const std::vector<HeldOut>& a, const std::vector<HeldOut>& b) {
    return fit_temperature(with_groups(presses, a, b)).growth;
  };
  EXPECT_EQ(growth(drawn_groups(500, 3, 5.0, 10), drawn_groups(500, 3, 5.0, 14)), 0.0);
  EXPECT_LT(growth(drawn_groups(1000, 3, 10.0, 11), drawn_groups(1000, 3, 10.0, 15)), 0.5);
  const std::vector<HeldOut> right(40, apart_in_five());
  EXPECT_EQ(growth(right, right), 0.0);
  EXPECT_EQ(growth({}, {}), 0.0);
  // A group that is surely wrong would like a growth of 20, which the other half does not.
  std::vector<HeldOut> wrong = right;
  wrong[3].truth = 1;
  EXPECT_EQ(growth(wrong, right), 0.0);
  EXPECT_GT(growth(wrong, wrong), 5.0) << "both halves show it";
}

TEST(TemperedByFolds, GivesEachFoldTheTemperatureOfTheOthers) {
  // Folds 0 to 2, of which the first differs from the others.
  std::vector<HeldOut> presses = drawn_presses(300, 4.0, 0.5, 5);
  const std::vector<HeldOut> blunt = drawn_presses(300, 40.0, 0.0, 6);
  std::array<std::vector<HeldOut>, 3> without;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const std::size_t fold = i % 3;
    presses[i] = fold == 0 ? blunt[i] : presses[i];
    presses[i].fold = fold;
    without[(fold + 1) % 3].push_back(presses[i]);
    without[(fold + 2) % 3].push_back(presses[i]);
  }
  const std::vector<HeldOut> tempered = tempered_by_folds(presses);
  ASSERT_EQ(tempered.size(), presses.size());
  std::array<TemperatureFit, 3> fits;
  std::ranges::transform(without, fits.begin(),
                         [](const auto& others) { return fit_temperature(others); });
  EXPECT_GT(fits[0].feature_weight, 0.2);
  EXPECT_GT(fits[1].temperature, 2.0 * fits[0].temperature);
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const TemperatureFit& other = fits[i % 3];
    const std::vector<double> nats =
        log_probabilities(presses[i], other.temperature, other.feature_weight);
    EXPECT_EQ(tempered[i].truth, presses[i].truth);
    EXPECT_EQ(tempered[i].fold, presses[i].fold);
    EXPECT_TRUE(tempered[i].log_density.empty()) << "the weight counts already";
    EXPECT_EQ(tempered[i].log_evidence, nats);
  }
}

TEST(TemperedByFolds, GivesGroupsTheGrowthOfTheOtherHalf) {
  std::vector<HeldOut> presses = drawn_groups(400, 1, 4.0, 12);
  std::vector<HeldOut> odd;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    presses[i].fold = i % 2;
    if (i % 2 == 1) {
      odd.push_back(presses[i]);
    }
  }
  std::vector<HeldOut> first = drawn_groups(400, 3, 20.0, 13);
  for (HeldOut& group : first) {
    group.fold = 0;
  }
  const std::vector<HeldOut> second(400, apart_in_five());
  const std::vector<HeldOut> tempered = tempered_by_folds(with_groups(presses, first, second));
  ASSERT_EQ(tempered.size(), 1200U);
  // The second half is told apart and shows no growth; the first half's temperature is about 20.
  const double temperature = fit_temperature(odd).temperature;
  EXPECT_NEAR(tempered[407].log_evidence[1], log_probabilities(first[7], temperature)[1], 1e-9);
  EXPECT_NEAR(tempered[800].log_evidence[1], -300.0 / 20.0, 2.0);
}

TEST(TemperedByFolds, TakesAllPressesWhereTheOtherHalfHasNoChoice) {
  const HeldOut choice{.truth = 0, .log_evidence = {-100.0, -300.0}};
  const HeldOut none{.truth = 0, .fold = 1, .log_evidence = {-100.0, -INFINITY}};
  const double alone = fit_temperature(std::vector{choice}).temperature;
  EXPECT_NEAR(tempered_by_folds(std::vector{choice}).front().log_evidence[1],
              -200.0 / alone - std::log1p(std::exp(-200.0 / alone)), 1e-9);
  const std::vector<HeldOut> tempered = tempered_by_folds(std::vector{none, choice});
  EXPECT_EQ(tempered[0].log_evidence[0], 0.0);
  EXPECT_LT(tempered[1].log_evidence[1], -1.0);
}

TEST(TemperedByFolds, StaysFiniteWhereAPressIsSurelyWrong) {
  std::vector<HeldOut> presses(20, {.truth = 0, .log_evidence = {0.0, -100.0}});
  for (std::size_t i = 0; i < presses.size(); ++i) {
    presses[i].fold = i % 2;
  }
  presses[4].log_evidence = {-1e6, 0.0};  // its probability is no number above 0
  const std::vector<HeldOut> tempered = tempered_by_folds(presses);
  EXPECT_LT(tempered[4].log_evidence[0], -1e4);
  EXPECT_TRUE(std::isfinite(scores_of(tempered, 1.0).log_loss));
}

TEST(TemperatureFit, RefusesWhatCannotBeTried) {
  EXPECT_THROW(fit_temperature({}), Error);
  EXPECT_THROW(fit_temperature(std::vector<HeldOut>{{.truth = 0, .log_evidence = {1.0}}}), Error);
}

TEST(GoldenSection, FindsTheLeastValueAtBothEndsTooAndTheLowestOfEqualOnes) {
  int calls = 0;
  const double found = least_at(-3.0, 7.0, 1e-6, [&](double x) {
    ++calls;
    return std::abs(x - 1.25);
  });
  EXPECT_NEAR(found, 1.25, 1e-6);
  // Each section leaves 0.618 of the interval: 34 for a factor of 1e7, and the two to begin with.
  EXPECT_LE(calls, 37);
  for (const auto& [slope, least] : {std::pair{-1.0, 5.0}, {1.0, 2.0}, {0.0, 2.0}}) {
    const auto line = [slope = slope](double x) { return slope * x; };
    EXPECT_NEAR(least_at(2.0, 5.0, 1e-4, line), least, 1e-4);
  }
}

}  // namespace palpate::temperature_fit_test
