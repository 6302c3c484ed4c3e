#include "learning/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "learning/feature_learning.hpp"
#include "learning/temperature_fit.hpp"
#include "palpate/error.hpp"
#include "simulated_presses.hpp"
#include "support/synthetic.hpp"

namespace palpate::cross_validation_test {

MapOptions map_options() { return {.cell_mm = 0.75, .sensor = {.spread_mm = 0.75, .prior = 0.2}}; }

TableLearning learning(const std::vector<TrainingMap>& maps) {
  return {.layer = {.near_mm = 3.0, .far_mm = 9.0},
          .contact = {.prior = 0.2},
          .lattice = placing_lattice(maps, 1.5, two_pi / 24.0),
          .rounds = 1};
}

/// Tries all folds on the maps of the others' presses, by Eq. 7 or a table that they learned.
CrossValidation tried(const std::vector<Press>& presses, const std::vector<std::string>& labels,
                      const CrossValidationOptions& options, bool with_table = false) {
  CrossValidation all;
  for (std::size_t fold = 0; fold < options.folds; ++fold) {
    const std::vector<Press> others = presses_without(fold, presses, options.folds);
    FoldModel model;
    model.maps = options.bins ? maps_by_folds(others, map_options(), 1).of_objects
                              : maps_of_presses(others, map_options());
    model.how = learning(model.maps);
    if (!options.bins && !others.empty()) {
      model.features = learn_features(others, model.how.contact.classifier);
    }
    if (with_table) {
      const std::vector<TrainingMap> maps =
          options.bins ? maps_by_folds(others, map_options(), 2).without_folds : model.maps;
      model.table = learn_table(others, maps, model.how).table;
    }
    all += try_fold(fold, presses, labels, model, options);
  }
  return all;
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

TEST(CrossValidation, LeavesOutAPressThatIsAloneOfItsObject) {
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
  LetterPresses letters;
  letters.add("A", 24, 16);
  letters.add("U", 14, 17);
  // A place that the presses do not have: only as unknowns do they come there.
  const CrossValidationOptions options{
      .folds = 2,
      .bins = RecognitionBins{.lattice = {.x_mm = {88.0, 112.0, 24},
                                          .y_mm = {-12.0, 12.0, 24},
                                          .theta_rad = {0.0, two_pi, 48}},
                              .auto_pivot = false}};
  const CrossValidation found = tried(letters.presses, {"A", "U"}, options);
  const std::vector<HeldOut> presses = alone(found.unknowns);
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
  const CrossValidation again = tried(letters.presses, {"A", "U"}, options);
  EXPECT_EQ(groups_in(again.unknowns).back().log_evidence, groups.back().log_evidence);
}

TEST(CrossValidation, TakesNoMoreMapsOfAnObjectThanItMay) {
  SimulatedPresses simulated;
  simulated.add_shapes(4, 21);
  const auto evidence = [&](std::size_t most) {
    return tried(simulated.presses, {"L", "disc"}, {.folds = 2, .maps_per_object = most})
        .unknowns.front()
        .log_evidence[0];
  };
  // The other fold has two presses of each: the mean over both is at least half of the first's.
  EXPECT_NE(evidence(2), evidence(1));
  EXPECT_GT(evidence(2), evidence(1) - std::log(2.0) - 1e-9);
  EXPECT_EQ(evidence(3), evidence(2));
}

TEST(CrossValidation, SharesTheGroupsOfFewPressesBetweenTheHalves) {
  LetterPresses letters;
  letters.add("A", 8, 16);
  letters.add("U", 8, 17);
  const CrossValidation found =
      tried(letters.presses, {"A", "U"},
            {.folds = 2,
             .bins = RecognitionBins{.lattice = {.x_mm = {-9.0, 9.0, 6},
                                                 .y_mm = {-9.0, 9.0, 6},
                                                 .theta_rad = {0.0, two_pi, 8}}}});
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
    const CrossValidation found =
        tried(letters.presses, {"A"},
              {.folds = 2,
               .bins = RecognitionBins{.lattice = {.x_mm = {-12.0, 12.0, bins},
                                                   .y_mm = {-12.0, 12.0, bins},
                                                   .theta_rad = {0.0, two_pi, theta_bins}},
                                       .auto_pivot = false}});
    double sum = 0.0;
    double count = 0.0;
    for (const HeldOut& unknown : found.unknowns) {
      sum += unknown.fit_z.value_or(0.0);
      count += unknown.fit_z ? 1.0 : 0.0;
    }
    return sum / count;
  };
  // At the nearest bin, up to 4 mm off, touches would fit worse by standard deviations.
  EXPECT_NEAR(mean_z(3, 4), mean_z(24, 48), 1e-6);
}

TEST(CrossValidation, JudgesHowPressesFitBestAndHowStrangersFitTheBestOfTwoOthers) {
  LetterPresses letters;
  letters.add("A", 48, 23);
  letters.add("U", 48, 24);
  const CrossValidationOptions options{
      .folds = 2,
      .bins = RecognitionBins{.lattice = {.x_mm = {-12.0, 12.0, 18},
                                          .y_mm = {-12.0, 12.0, 18},
                                          .theta_rad = {0.0, two_pi, 30}},
                              .auto_pivot = false}};
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
  const CrossValidation found = tried(letters.presses, {"A", "B", "U"}, options, true);
  std::size_t judged = 0;
  double own_z = 0.0;
  double best_z = 0.0;
  for (const HeldOut& unknown : found.unknowns) {
    ASSERT_EQ(unknown.best_fit_z.has_value(), unknown.fit_z.has_value());
    judged += unknown.fit_z ? 1 : 0;
    own_z += unknown.fit_z.value_or(0.0);
    best_z += unknown.best_fit_z.value_or(0.0);
  }
  EXPECT_TRUE(std::ranges::none_of(
      eq7.unknowns, [](const HeldOut& unknown) { return unknown.best_fit_z.has_value(); }));
  EXPECT_GT(best_z, own_z + 0.1 * static_cast<double>(judged))
      << "a single touch fits somewhere else better";
  const auto fits = strangers(found);
  ASSERT_EQ(fits.size(), 3U);
  const auto mean_z = [&](std::size_t label, std::size_t touches) {
    std::vector<double> z;
    for (const StrangerFit& stranger : fits.at(label)) {
      if (stranger.touches == touches) {
        z.push_back(stranger.fit.z);
      }
    }
    EXPECT_FALSE(z.empty()) << label;
    return std::accumulate(z.begin(), z.end(), 0.0) / static_cast<double>(z.size());
  };
  constexpr std::size_t u = 2;
  for (const std::size_t alike : {0U, 1U}) {
    EXPECT_LT(mean_z(u, 1), mean_z(alike, 1)) << alike;
    EXPECT_LT(mean_z(u, presses_in_group), mean_z(alike, presses_in_group) - 3.0) << alike;
  }
}

TEST(CrossValidation, LeavesOutPressesWhoseObjectHasNoMapWithoutThem) {
  SimulatedPresses simulated;
  simulated.add_shapes(1, 14);
  EXPECT_TRUE(tried(simulated.presses, {"L", "disc"}, {}).unknowns.empty());
}

}  // namespace palpate::cross_validation_test
