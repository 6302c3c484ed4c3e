#include "cross_validation.hpp"

#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"
#include "simulated_presses.hpp"
#include "synthetic.hpp"

namespace palpate {
namespace {

MapOptions map_options() { return {.cell_mm = 0.75, .sensor = {.spread_mm = 0.75, .prior = 0.2}}; }

TableLearning learning(const std::vector<TrainingMap>& maps) {
  return {.layer = {.near_mm = 3.0, .far_mm = 9.0},
          .contact = {.prior = 0.2},
          .lattice = placing_lattice(maps, 1.5, two_pi / 24.0),
          .rounds = 1};
}

TEST(CrossValidation, TriesEveryPressOnMapsOfOtherFolds) {
  SimulatedPresses simulated;
  simulated.add_shapes(3, 11);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  const TableLearning how = learning(maps);
  const PlacedPresses placed = learn_table(simulated.presses, maps, how);
  for (const PlacedPresses* with : {static_cast<const PlacedPresses*>(nullptr), &placed}) {
    const CrossValidation found = cross_validate(simulated.presses, maps, how, with, {.folds = 3});
    EXPECT_EQ(found.labels, (std::vector<std::string>{"L", "disc"}));
    ASSERT_EQ(found.presses.size(), 6U);
    EXPECT_EQ(found.known.size(), 6U);
    EXPECT_EQ(found.unknown.size(), 6U);
    // The shapes differ by tens of elements: evidence tells them apart by tens of nats.
    EXPECT_NEAR(scores_of(found.presses, 1.0).accuracy(), 1.0, 1e-9);
    EXPECT_GT(area_under_curve({found.known, found.unknown},
                               fit_familiarity({found.known, found.unknown})),
              0.8);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_LE(found.unknown[i].explained, found.known[i].explained);
      EXPECT_LT(found.known[i].explained, 0.0);
      EXPECT_EQ(found.presses[i].log_density.size(), 2U);
    }
  }
}

TEST(CrossValidation, LeavesOutAPressThatIsAloneOfItsObject) {
  SimulatedPresses simulated;
  simulated.add(on_letter_l, "L", 2, 12);
  simulated.add(on_disc, "disc", 1, 13);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  const TableLearning how = learning(maps);
  const CrossValidation found = cross_validate(simulated.presses, maps, how, nullptr, {.folds = 2});
  ASSERT_EQ(found.presses.size(), 2U);
  // The disc's only press is in the first fold, so that it has no map for the L of that fold.
  EXPECT_EQ(found.presses[0].log_evidence[1], -INFINITY);
  EXPECT_TRUE(std::isfinite(found.presses[1].log_evidence[1]));
  EXPECT_EQ(found.unknown.size(), 1U);
  EXPECT_GT(fit_temperature(found.presses).temperature, 0.0);
}

TEST(CrossValidation, LooksForPressesAtKnownPosesAsForUnknownsAloneAndInGroups) {
  LetterPresses letters;
  letters.add("A", 24, 16);
  letters.add("U", 14, 17);
  const std::vector<TrainingMap> maps = maps_without_folds(letters.presses, map_options(), 2);
  TableLearning how = learning(maps);
  how.lattice = {};  // not used
  // A place that the presses do not have: only as unknowns do they come there.
  const CrossValidationOptions options{
      .folds = 2,
      .bins = RecognitionBins{.lattice = {.x_mm = {88.0, 112.0, 24},
                                          .y_mm = {-12.0, 12.0, 24},
                                          .theta_rad = {0.0, two_pi, 48}},
                              .auto_pivot = false}};
  const CrossValidation found = cross_validate(letters.presses, maps, how, nullptr, options);
  ASSERT_EQ(found.presses.size(), 38U);
  // Of either fold's 12 presses of A, 6 in each half make two groups three times over; of 7 of U, 3
  // and 4 make one group each.
  const std::vector<ScoredPress> groups = both(found.groups);
  EXPECT_EQ(groups.size(), 2U * (2U * 3U * 2U + 2U));
  EXPECT_FALSE(found.groups[0].empty() || found.groups[1].empty());
  EXPECT_LE(found.known.size(), 38U) << "groups say nothing of familiarity";
  for (const ScoredPress& press : found.presses) {
    EXPECT_EQ(press.touches, 1U);
    EXPECT_TRUE(press.log_density.empty()) << "features tell where a touch was";
  }
  for (const ScoredPress& group : groups) {
    EXPECT_EQ(group.touches, presses_in_group);
  }
  EXPECT_GT(scores_of(groups, 1.0).accuracy(), 0.95) << "24 of 28 are of A";
  EXPECT_GT(scores_of(found.presses, 1.0).accuracy(), 0.85) << "24 of 38 are of A";
  const CrossValidation again = cross_validate(letters.presses, maps, how, nullptr, options);
  EXPECT_EQ(both(again.groups).back().log_evidence, groups.back().log_evidence);
}

TEST(CrossValidation, JudgesTheFitOfPressesAtKnownPosesWhereTheyAre) {
  LetterPresses letters;
  letters.add("A", 20, 19);
  const std::vector<TrainingMap> maps = maps_without_folds(letters.presses, map_options(), 2);
  const auto mean_z = [&](int bins, int theta_bins) {
    const CrossValidation found =
        cross_validate(letters.presses, maps, learning(maps), nullptr,
                       {.folds = 2,
                        .bins = RecognitionBins{.lattice = {.x_mm = {-12.0, 12.0, bins},
                                                            .y_mm = {-12.0, 12.0, bins},
                                                            .theta_rad = {0.0, two_pi, theta_bins}},
                                                .auto_pivot = false}});
    return std::accumulate(found.fit_z.begin(), found.fit_z.end(), 0.0) /
           static_cast<double>(found.fit_z.size());
  };
  // At the nearest bin, up to 4 mm off, touches would fit worse by standard deviations.
  EXPECT_NEAR(mean_z(3, 4), mean_z(24, 48), 1e-6);
}

TEST(CrossValidation, RefusesBinsForPressesAtUnknownPoses) {
  SimulatedPresses simulated;
  simulated.add_shapes(3, 18);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  EXPECT_THROW(cross_validate(simulated.presses, maps, learning(maps), nullptr,
                              {.folds = 3, .bins = RecognitionBins{}}),
               Error);
}

TEST(CrossValidation, RefusesWhatItCannotTry) {
  SimulatedPresses simulated;
  simulated.add_shapes(1, 14);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  const TableLearning how = learning(maps);
  EXPECT_THROW(cross_validate(simulated.presses, maps, how, nullptr, {}), Error);
  simulated.add_shapes(1, 15);
  EXPECT_THROW(cross_validate(simulated.presses, maps, how, nullptr, {.folds = 1}), Error);
}

}  // namespace
}  // namespace palpate
