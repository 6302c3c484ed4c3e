#include "learning/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "learning/held_out.hpp"
#include "model/random.hpp"
#include "simulated_presses.hpp"

namespace palpate::cross_validation_test {

/// Tries all folds on the maps of the others' presses, by Eq. 7 or a table that they learned.
CrossValidation tried(const std::vector<Press>& presses, const std::vector<std::string>& labels,
                      const CalibrationSettings& options, bool with_table = false) {
  CrossValidation all;
  for (std::size_t fold = 0; fold < options.folds; ++fold) {
    const std::vector<Press> others = presses_without(fold, presses, options.folds);
    FoldModel model;
    model.maps = options.bins ? maps_by_folds(others, map_options(), 1).of_objects
                              : maps_of_presses(others, map_options());
    model.learning = learning_on(model.maps);
    model.learning.rounds = 1;
    if (!options.bins && !others.empty()) {
      model.features = learn_features(others, model.learning.contact.classifier);
    }
    if (with_table) {
      const std::vector<TrainingMap> maps =
          options.bins ? maps_by_folds(others, map_options(), 2).without_folds : model.maps;
      model.table = learn_table(others, maps, model.learning).table;
    }
    all += try_fold(fold, presses, labels, model, options);
  }
  return all;
}

/// Two folds on bins about this place.
CalibrationSettings on_bins(int bins, int theta_bins, double half_mm = 12.0, double x_mm = 0.0) {
  return {.folds = 2,
          .bins = RecognitionBins{.lattice = {.x_mm = {x_mm - half_mm, x_mm + half_mm, bins},
                                              .y_mm = {-half_mm, half_mm, bins},
                                              .theta_rad = {0.0, two_pi, theta_bins}},
                                  .auto_pivot = false}};
}

TEST(CrossValidation, TriesEveryPressOnMapsOfOtherFolds) {
  SimulatedPresses simulated;
  simulated.add_shapes(3, 11);
  for (const bool with_table : {false, true}) {
    const CrossValidation found = tried(simulated.presses, {"L", "disc"}, {.folds = 3}, with_table);
    ASSERT_EQ(found.unknowns.size(), 6U);
    // The shapes differ by tens of elements: evidence tells them apart by tens of nats.
    EXPECT_NEAR(scores_of(found.unknowns, 1.0).accuracy(), 1.0, 1e-9);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_EQ(found.unknowns[i].fold, i / 2);
      EXPECT_EQ(found.unknowns[i].log_density.size(), 2U);
    }
  }
}

TEST(CrossValidation, LeavesOutPressesWhoseObjectHasNoMapWithoutThem) {
  SimulatedPresses one_each;
  one_each.add_shapes(1, 14);
  EXPECT_TRUE(tried(one_each.presses, {"L", "disc"}, {}).unknowns.empty());
  SimulatedPresses simulated;
  simulated.add(on_letter_l, "L", 2, 12);
  simulated.add(on_disc, "disc", 1, 13);
  const CrossValidation found = tried(simulated.presses, {"L", "disc"}, {.folds = 2});
  ASSERT_EQ(found.unknowns.size(), 2U);
  // The disc's only press is in the first fold, so that it has no map for the L of that fold.
  EXPECT_EQ(found.unknowns[0].log_evidence[1], -INFINITY);
  EXPECT_TRUE(std::isfinite(found.unknowns[1].log_evidence[1]));
  EXPECT_GT(fit_temperature(found.unknowns).temperature, 0.0);
}

TEST(CrossValidation, LooksForPressesAtKnownPosesAsForUnknownsAloneAndInGroups) {
  const LetterPresses letters = two_letters(24, 14, 16);
  // A place that the presses do not have: only as unknowns do they come there.
  const CalibrationSettings options = on_bins(24, 48, 12.0, 100.0);
  const CrossValidation found = tried(letters.presses, {"A", "U"}, options);
  const std::vector<HeldOut> presses = single_touches(found.unknowns);
  ASSERT_EQ(presses.size(), 38U);
  // Either fold has 12 presses of A: the 6 of each half make two groups three times over. It has 7
  // presses of U: 3 and 4 make one group each.
  const std::vector<HeldOut> groups = groups_in(found.unknowns);
  EXPECT_EQ(groups.size(), 2U * (2U * 3U * 2U + 2U));
  EXPECT_NE(groups.front().half, groups.back().half);
  for (const HeldOut& press : presses) {
    EXPECT_EQ(press.touches, 1U);
    EXPECT_TRUE(press.log_density.empty()) << "features tell where a touch was";
  }
  for (const HeldOut& group : groups) {
    EXPECT_EQ(group.touches, presses_in_group);
  }
  EXPECT_GT(scores_of(groups, 1.0).accuracy(), 0.95) << "24 of 28 are of A";
  EXPECT_GT(scores_of(presses, 1.0).accuracy(), 0.85) << "24 of 38 are of A";
}

TEST(CrossValidation, TakesNoMoreMapsOfAnObjectThanItMay) {
  SimulatedPresses simulated;
  simulated.add_shapes(4, 21);
  const auto evidence = [&](std::size_t most) {
    return tried(simulated.presses, {"L", "disc"}, {.folds = 2, .most_maps = most})
        .unknowns.front()
        .log_evidence[0];
  };
  // The other fold has two presses of each: the mean over both is at least half of the first's.
  EXPECT_NE(evidence(2), evidence(1));
  EXPECT_GT(evidence(2), evidence(1) - std::log(2.0) - 1e-9);
  EXPECT_EQ(evidence(3), evidence(2));
}

TEST(CrossValidation, SharesTheGroupsOfFewPressesBetweenTheHalves) {
  const CrossValidation found =
      tried(two_letters(8, 8, 16).presses, {"A", "U"}, on_bins(6, 8, 9.0));
  // One of each letter in each fold.
  for (const std::size_t one : {0U, 1U}) {
    const std::vector<HeldOut> half = of_half(found.unknowns, one);
    ASSERT_EQ(half.size(), 2U);
    EXPECT_NE(half[0].fold, half[1].fold);
    EXPECT_NE(half[0].truth, half[1].truth);
  }
}

TEST(CrossValidation, JudgesTheFitOfPressesAtKnownPosesWhereTheyAre) {
  LetterPresses letters;
  letters.add("A", 20, 19);
  const auto mean_z = [&](int bins, int theta_bins) {
    double sum = 0.0;
    double count = 0.0;
    for (const HeldOut& unknown :
         tried(letters.presses, {"A"}, on_bins(bins, theta_bins)).unknowns) {
      sum += unknown.fit_z.value_or(0.0);
      count += unknown.fit_z ? 1.0 : 0.0;
    }
    return sum / count;
  };
  // At the nearest bin, up to 4 mm off, touches would fit worse by standard deviations.
  EXPECT_NEAR(mean_z(3, 4), mean_z(24, 48), 1e-6);
}

TEST(CrossValidation, JudgesHowPressesFitBestAndHowStrangersFitTheBestOfTwoOthers) {
  LetterPresses letters = two_letters(48, 48, 23);
  const CalibrationSettings options = on_bins(18, 30);
  const auto strangers = [](const CrossValidation& of) {
    return by_label(of.unknowns, &HeldOut::stranger_fit);
  };
  EXPECT_TRUE(strangers(tried(letters.presses, {"A", "U"}, options, true)).empty());
  // Another A under a label of its own: left out, either fits the other well.
  letters.add("A", 48, 25);
  letters.recordings.back().object = "B";
  letters.make_presses(true);
  const CrossValidation eq7 = tried(letters.presses, {"A", "B", "U"}, options);
  EXPECT_TRUE(strangers(eq7).empty());
  EXPECT_TRUE(std::ranges::none_of(
      eq7.unknowns, [](const HeldOut& unknown) { return unknown.best_fit_z.has_value(); }));
  const CrossValidation found = tried(letters.presses, {"A", "B", "U"}, options, true);
  double judged = 0.0;
  double gained_z = 0.0;
  for (const HeldOut& unknown : found.unknowns) {
    ASSERT_EQ(unknown.best_fit_z.has_value(), unknown.fit_z.has_value());
    judged += unknown.fit_z ? 1.0 : 0.0;
    gained_z += unknown.best_fit_z.value_or(0.0) - unknown.fit_z.value_or(0.0);
  }
  EXPECT_GT(gained_z, 0.1 * judged) << "a single touch fits somewhere else better";
  const auto fits = strangers(found);
  ASSERT_EQ(fits.size(), 3U);
  const auto mean_z = [&](std::size_t label, std::size_t touches) {
    double sum = 0.0;
    double count = 0.0;
    for (const StrangerFit& stranger : fits.at(label)) {
      sum += stranger.touches == touches ? stranger.fit.z : 0.0;
      count += stranger.touches == touches ? 1.0 : 0.0;
    }
    EXPECT_GT(count, 0.0) << label;
    return sum / count;
  };
  constexpr std::size_t u = 2;
  for (const std::size_t alike : {0U, 1U}) {
    EXPECT_LT(mean_z(u, 1), mean_z(alike, 1)) << alike;
    EXPECT_LT(mean_z(u, presses_in_group), mean_z(alike, presses_in_group) - 3.0) << alike;
  }
}

TEST(ClearlyLess, IsByMoreThanTwoStandardErrors) {
  // A hundred differences, one above and one below their mean in turn: a standard error of 0.1005.
  const auto clearly_less = [](double mean, double deviation) {
    std::vector<double> losses;
    for (int i = 0; i < 100; ++i) {
      losses.push_back(10.0 - mean + (i % 2 == 0 ? deviation : -deviation));
    }
    return difference_of(losses, std::vector(100, 10.0)).is_clear();
  };
  EXPECT_TRUE(clearly_less(0.21, 1.0));
  EXPECT_FALSE(clearly_less(0.19, 1.0));
  EXPECT_FALSE(clearly_less(-2.0, 1.0));
  EXPECT_FALSE(clearly_less(0.0, 0.0));
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
    std::vector<Drawn> strangers;
    for (const std::size_t label : {0U, 1U, 2U}) {
      strangers.push_back({label, 300, 3, truth});
      strangers.push_back({label, 100, 2, truth});
    }
    EXPECT_NEAR(sd_of(fits_of(strangers)).value(), truth, 0.1 * truth);
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

}  // namespace palpate::cross_validation_test
