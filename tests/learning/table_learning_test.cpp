#include "learning/table_learning.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "learning/press_placement.hpp"
#include "model/bounding_box.hpp"
#include "model/touch_evidence.hpp"
#include "palpate/error.hpp"
#include "palpate/learned_sensor.hpp"
#include "simulated_presses.hpp"
#include "support/errors.hpp"
#include "support/synthetic.hpp"

namespace palpate::table_learning_test {

/// All readings.
double total(const LevelCounts& counts) {
  double sum = 0.0;
  for (int node = 0; node < ReadingLayer::nodes; ++node) {
    sum += counts.at_node(node);
  }
  return sum;
}

TEST(TableLearning, CountsPressesAtKnownPosesWithinABinOfThem) {
  LetterPresses letters;
  letters.add("A", 6, 61);
  const std::vector<TrainingMap> maps =
      maps_by_folds(letters.presses, map_options(), 3).without_folds;
  TableLearning settings = learning_on(maps);
  const std::vector<OccupancyGrid> layers = layers_of(maps, settings.layer);
  const PlacedPresses placed = learn_table(letters.presses, maps, settings);
  EXPECT_EQ(placed.placements.size(), 6U);
  for (const OwnPlacement& own : placed.placements) {
    EXPECT_FALSE(maps[own.map].holds(own.press));
  }
  const auto counts_of = [&](const std::vector<Press>& presses) {
    return count_placed(placed.placements, presses, layers, settings).at("A");
  };
  // Exactly at the poses of the 27 bins about each press, turned about the middle of all presses.
  BoundingBox box;
  for (const Press& press : letters.presses) {
    box.take_in(press.T_object_robot->translation_mm);
  }
  const Pose about{box.middle(), 0.0};
  LevelCounts expected(2);
  for (int i = 0; i < 27; ++i) {
    const Pose turned{{}, (i % 3 - 1) * 0.1};
    const Pose moved{{(i / 3 % 3 - 1) * 0.5, (i / 9 - 1) * 0.3}, 0.0};
    std::vector<Press> presses = letters.presses;
    for (Press& press : presses) {
      press.T_object_robot = moved * about * turned * inverse(about) * *press.T_object_robot;
    }
    expected += counts_of(presses);
  }
  settings.counted_within = {.x_mm = 1.5, .y_mm = 0.9, .theta_rad = 0.3};
  const LevelCounts within = counts_of(letters.presses);
  for (int node = 0; node < ReadingLayer::nodes; ++node) {
    EXPECT_NEAR(27.0 * within.at(0, node), expected.at(0, node), 1e-5) << node;
    EXPECT_NEAR(27.0 * within.at(1, node), expected.at(1, node), 1e-5) << node;
  }
}

TEST(TableLearning, CountsPressesAtUnknownPosesWhereTheyLie) {
  SimulatedPresses simulated;
  simulated.add_shapes(5, 3);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  const TableLearning settings = learning_on(maps);
  double shown = 0.0;
  const PlacedPresses placed = learn_table(simulated.presses, maps, settings, [&](double fraction) {
    EXPECT_GE(fraction, shown);
    shown = fraction;
  });
  EXPECT_EQ(shown, 1.0);
  EXPECT_EQ(placed.placements.size(), 40U);
  const ObjectCounts counts =
      count_placed(placed.placements, simulated.presses, layers_of(maps, settings.layer), settings);
  EXPECT_EQ(placed.table.shared, table_of(counts, settings).shared);
  EXPECT_NE(placed.table.shared, settings.initial().shared);
  // Presses lie within a bin of where they were, all but few.
  int right = 0;
  for (const OwnPlacement& own : placed.placements) {
    const Pose truth_pose =
        inverse(simulated.T_object_robot[own.map]) * simulated.T_object_robot[own.press];
    const double off_mm =
        glm::distance(truth_pose.translation_mm, own.placement.T_object_robot.translation_mm);
    right += simulated.presses[own.press].label == "L" && off_mm < 2.0 ? 1 : 0;
  }
  EXPECT_GE(right, 16) << "of 20";
}

TEST(TableLearning, CountsAPressOnItsBestMapsOnly) {
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 3, 4);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  TableLearning settings = learning_on(maps);
  const Pose far{{1000.0, 0.0}, 0.0};
  const std::vector<OwnPlacement> placements{{0, 1, {Pose{}, -5.0, 0.0}}, {0, 2, {far, -9.0, 0.0}}};
  const auto counts = [&](std::size_t best_maps) {
    settings.best_maps = best_maps;
    return count_placed(placements, simulated.presses, layers_of(maps, settings.layer), settings)
        .at("disc");
  };
  EXPECT_NEAR(total(counts(1)), 196.0, 1e-9);
  EXPECT_EQ(counts(1).at_node(8), 0.0) << "no reading is beyond the map";
  EXPECT_NEAR(counts(3).at_node(8), 196.0, 1e-9);
}

TEST(TableLearning, ShrinksObjectsTowardsAllTogether) {
  const TableLearning settings{.contact = {.prior = 0.2}};
  ObjectCounts counts{{"A", LevelCounts(2)}, {"B", LevelCounts(2)}};
  counts.at("A").add(Reading::in_contact, 0.0, 100.0);
  counts.at("B").add(Reading::no_contact, 0.0, 100.0);
  const LearnedTable table = table_of(counts, settings);
  const double eq7 = 0.5;  // at log odds 0 both readings are as likely
  const double shared = (100.0 + 20.0 * eq7) / 220.0;
  EXPECT_NEAR(std::exp(table.shared[49 + 32]), shared, 1e-12);
  EXPECT_NEAR(std::exp(table.objects.at("A")[49 + 32]), (100.0 + 200.0 * shared) / 300.0, 1e-12);
  EXPECT_NEAR(std::exp(table.objects.at("B")[49 + 32]), 200.0 * shared / 300.0, 1e-12);
  EXPECT_EQ(contact_with(settings.contact, table, "C").table->log_likelihood, table.shared);
  EXPECT_EQ(contact_with(settings.contact, table, "A").table->log_likelihood,
            table.objects.at("A"));
}

TEST(TableLearning, OfNoPairOfPressesIsRefused) {
  SimulatedPresses simulated;
  simulated.add_shapes(1, 5);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  expect_named(input_error([&] { learn_table(simulated.presses, maps, learning_on(maps)); }),
               {"at least two touches of one object"});
  LetterPresses posed;
  posed.add("A", 4, 6);
  const MapsByFolds of_one_fold = maps_by_folds(posed.presses, map_options(), 1);
  EXPECT_TRUE(of_one_fold.without_folds.empty());
  EXPECT_THROW(learn_table(posed.presses, {}, learning_on(of_one_fold.of_objects)), Error);
}

/// The node whose value this is.
int node_of(double value) { return static_cast<int>(std::lround((value + 16.0) * 2.0)); }

TEST(LevelCounts, DividesAReadingBetweenTheNodesBesideIt) {
  LevelCounts counts(3);
  counts.add(Reading::no_contact, -16.0);
  counts.add(Reading::in_contact, 0.125);
  counts.add(contact_level(1), 100.0);
  counts.add(Reading::unknown, 0.0);
  EXPECT_DOUBLE_EQ(counts.at(0, 0), 1.0);
  EXPECT_DOUBLE_EQ(counts.at(1, node_of(0.0)), 0.75);
  EXPECT_DOUBLE_EQ(counts.at(1, node_of(0.5)), 0.25);
  EXPECT_DOUBLE_EQ(counts.at(2, 48), 1.0);
  EXPECT_DOUBLE_EQ(total(counts), 3.0);
  LevelCounts twice = counts;
  twice += counts;
  EXPECT_DOUBLE_EQ(twice.at_node(node_of(0.0)), 1.5);
}

TEST(LevelCounts, ReadsTheLayerAtTheElementsOfAPlacedTouch) {
  OccupancyGrid layer{.label = "A", .cell_mm = 1.0, .origin_mm = {0.0, 0.0}, .nx = 2, .ny = 1};
  layer.prior = probability_from_log_odds(ReadingLayer::beyond);
  layer.log_odds = {-3.0F, 5.0F};
  const std::vector<glm::dvec2> elements{{0.0, 0.0}, {1.0, 0.0}, {2.0, 0.0}, {50.0, 0.0}};
  const std::vector<double> pressure{0.0, 20.0, 40.0, 0.0};
  const Touch touch{{{2.0, 0.0}, two_pi / 4.0}, elements, pressure};
  ContactModel model{.classifier = {.threshold = 2.0, .ratio = 0.1}};
  model.table = LikelihoodTable{.nodes = 49, .level_edges = {30.0}, .log_likelihood = {}};
  LevelCounts counts(3);
  // The sensor is moved by -1 mm along x, so that elements 1 and 2 lie on the layer's cells.
  const Pose T_object_robot{{-1.0, 2.0}, -two_pi / 4.0};
  counts.add(evidence_of(std::span(&touch, 1), model), std::span(&T_object_robot, 1), layer);
  EXPECT_NEAR(counts.at(1, node_of(-3.0)), 1.0, 1e-9);
  EXPECT_NEAR(counts.at(2, node_of(5.0)), 1.0, 1e-9);
  EXPECT_NEAR(counts.at(0, node_of(-12.0)), 2.0, 1e-9) << "beyond the layer";
}

/// The probability of a level that a table has at a layer's value.
double probability(const std::vector<double>& table, std::size_t level, double value) {
  return std::exp(table[level * 49 + static_cast<std::size_t>(node_of(value))]);
}

TEST(InitialTable, IsEquation7OverLogOdds) {
  const std::vector<double> table = initial_table({}, 2, {.gamma = 0.2, .prior = 0.1});
  ASSERT_EQ(table.size(), 98U);
  const auto p = [&](std::size_t level, double value) { return probability(table, level, value); };
  // gamma m + (1 - gamma) p over the sum of both readings, 2 gamma m + 1 - gamma = 0.84.
  EXPECT_NEAR(p(1, 0.0), (0.02 + 0.8 * 0.5) / 0.84, 1e-12);
  EXPECT_NEAR(p(1, 2.0), (0.02 + 0.8 / (1.0 + std::exp(-2.0))) / 0.84, 1e-12);
  EXPECT_NEAR(p(0, 2.0) + p(1, 2.0), 1.0, 1e-12);
  for (const double unseen : {-16.0, -15.0, -12.0, -10.0, -8.5}) {
    EXPECT_NEAR(p(1, unseen), (0.02 + 0.8 * 0.1) / 0.84, 1e-12) << unseen;
  }
  EXPECT_NEAR(p(1, -8.0), (0.02 + 0.8 / (1.0 + std::exp(8.0))) / 0.84, 1e-12);
}

TEST(InitialTable, OverMeanLevelsStartsAtTheThreshold) {
  const ReadingLayer layer = mean_level_layer(15.0, 255.0);
  EXPECT_DOUBLE_EQ(layer.unit_level, 1.0);
  const std::vector<double> table =
      initial_table(layer, 4, {.classifier = {.threshold = 15.0}, .gamma = 0.0, .prior = 0.1});
  EXPECT_NEAR(probability(table, 0, 0.0), 0.5, 1e-12);
  EXPECT_NEAR(probability(table, 3, 0.0), 0.5 / 3.0, 1e-12);
  EXPECT_NEAR(probability(table, 0, 3.0), 1.0 / (1.0 + std::exp(3.0)), 1e-12);
}

TEST(MeanLevelLayer, TakesAnyPressure) {
  EXPECT_DOUBLE_EQ(mean_level_layer(2.0, 0.0).unit_level, 2.0);
  EXPECT_DOUBLE_EQ(mean_level_layer(2.0, 0.0).full_level, 6.0);
  EXPECT_THROW(mean_level_layer(0.0, 255.0), Error);
}

TEST(ShrunkTable, AddsPseudoCountsAndHasAFloor) {
  LevelCounts counts(2);
  counts.add(Reading::in_contact, 1.0, 24.0);
  counts.add(Reading::no_contact, 1.0, 6.0);
  // Twice the probabilities: they are normalised.
  std::vector<double> towards(98, 0.0);
  std::vector<double> table = shrunk_table(counts, towards, 20.0);
  const auto at = static_cast<std::size_t>(node_of(1.0));
  EXPECT_NEAR(std::exp(table[at]), (6.0 + 10.0) / 50.0, 1e-12);
  EXPECT_NEAR(std::exp(table[49 + at]), (24.0 + 10.0) / 50.0, 1e-12);
  EXPECT_NEAR(std::exp(table[0]), 0.5, 1e-12) << "a node without counts keeps what it had";
  LevelCounts free(2);
  free.add(Reading::no_contact, 1.0);
  std::fill(towards.begin() + 49, towards.end(), -100.0);
  table = shrunk_table(free, towards, 20.0);
  EXPECT_DOUBLE_EQ(table[49], std::log(1e-6));
  EXPECT_DOUBLE_EQ(table[49 + at], std::log(1e-6));
}

/// Expects of a press on a map the log-likelihood of the best of all bins, and about the evidence,
/// that the reference has.
PressPlacement expect_best(const Press& press, const Hypothesis& hypothesis,
                           const ContactModel& contact, const PoseLattice& lattice,
                           double evidence_nats) {
  const OccupancyGrid& map = hypothesis.compared();
  const std::vector<double> nats =
      reference::log_likelihoods(press.touches, lattice, map, tabulated(contact));
  const double best = *std::ranges::max_element(nats);
  double sum = 0.0;
  for (const double x : nats) {
    sum += std::exp(x - best);
  }
  const PressPlacement found =
      PressPlacer(hypothesis, contact, lattice).place(evidence_of(press.touches, contact));
  EXPECT_NEAR(found.log_likelihood, best, 1e-6);
  EXPECT_NEAR(found.log_evidence, best + std::log(sum / static_cast<double>(nats.size())),
              evidence_nats);
  return found;
}

TEST(PressPlacer, FindsTheBestBinOfTheReference) {
  SimulatedPresses simulated;
  simulated.add(on_letter_l, "L", 4, 21);
  // Dead elements, and Unknown ones: between the threshold and the ratio of the largest.
  simulated.recordings[2].valid.assign(196, 1);
  for (std::size_t e = 0; e < 20; ++e) {
    simulated.recordings[2].valid[9 * e] = 0;
    simulated.recordings[3].pressure[7 * e] = 2.5;
  }
  const Hypothesis hypothesis{.map = map_of(on_letter_l, "L")};
  const PoseLattice lattice{.x_mm = {-5.0, 5.0, 7},
                            .y_mm = {-4.0, 6.0, 6},
                            .theta_rad = {0.0, two_pi, 16},
                            .pivot_mm = {0.5, -1.0}};
  const ContactModel contact{.prior = hypothesis.map.prior};
  for (const Recording& recording : simulated.recordings) {
    SCOPED_TRACE(recording.path);
    const Press press = single_press(recording, 0);
    const PressPlacement found = expect_best(press, hypothesis, contact, lattice, 0.05);
    EXPECT_NEAR(reference::log_likelihood(press.touches[0], found.T_object_robot, hypothesis.map,
                                          tabulated(contact)),
                found.log_likelihood, 1e-6);
  }
}

TEST(PressPlacer, TakesTouchesAtPosesAndATableOverALayer) {
  const OccupancyGrid map = map_of(on_letter_l, "L");
  const Hypothesis hypothesis{.map = map, .layer = reading_layer(map, {})};
  ContactModel contact{.prior = probability_from_log_odds(ReadingLayer::beyond)};
  LikelihoodTable table{.first_log_odds = -16.0, .last_log_odds = 8.0, .nodes = 49};
  for (int node = 0; node < 98; ++node) {
    table.log_likelihood.push_back(node < 49 ? -0.05 * (node % 49) : -3.0 + 0.06 * (node % 49));
  }
  contact.table = table;
  const PoseLattice lattice{
      .x_mm = {-6.0, 6.0, 9}, .y_mm = {-6.0, 6.0, 9}, .theta_rad = {0.0, two_pi, 16}};
  const Recording first = touches_of(on_letter_l, {{1.0, 0.5}, 0.8}, 4, 22);
  const Recording second = touches_of(on_letter_l, {{-1.0, 1.5}, 2.8}, 6, 23);
  PressPlacer placer(hypothesis, contact, lattice);
  for (const Recording* recording : {&first, &second, &first}) {  // one placer, several presses
    const Press press{.name = "touches", .label = "L", .touches = all_touches(*recording)};
    EXPECT_EQ(placer.place(evidence_of(press.touches, contact)).log_likelihood,
              expect_best(press, hypothesis, contact, lattice, 0.3).log_likelihood);
  }
}

TEST(PressPlacer, OfASingleBinEvaluatesItAndRefusesWhatIsTooFarAway) {
  SimulatedPresses simulated;
  simulated.add(on_disc, "disc", 1, 24);
  const Hypothesis hypothesis{.map = map_of(on_disc, "disc")};
  const ContactModel contact{.prior = hypothesis.map.prior};
  const PoseLattice lattice{
      .x_mm = {1.0, 1.0, 1}, .y_mm = {0.0, 0.0, 1}, .theta_rad = {0.2, 0.2, 1}};
  std::vector<Touch>& touches = simulated.presses[0].touches;
  const PressPlacement found =
      PressPlacer(hypothesis, contact, lattice).place(evidence_of(touches, contact));
  EXPECT_NEAR(found.log_evidence, found.log_likelihood, 1e-12);
  EXPECT_NEAR(found.T_object_robot.translation_mm.x, 1.0, 1e-12);
  touches[0].T_robot_sensor.translation_mm = {1e8, 0.0};
  PressPlacer placer(hypothesis, contact, {});
  EXPECT_THROW(placer.place(evidence_of(touches, contact)), Error);
}

}  // namespace palpate::table_learning_test
