#include "learning/table_learning.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include "model/bounding_box.hpp"
#include "model/interpolated_map.hpp"
#include "simulated_presses.hpp"
#include "support/errors.hpp"

namespace palpate::table_learning_test {

/// Counts as count_placed() would with every press on every other map of its object, at its true
/// place.
LevelCounts true_counts(const SimulatedPresses& simulated, const std::vector<TrainingMap>& maps,
                        const TableLearning& how) {
  const std::vector<OccupancyGrid> layers = layers_of(maps, how.layer);
  LevelCounts counts(2);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    for (std::size_t j = 0; j < layers.size(); ++j) {
      if (i != j && simulated.presses[i].label == simulated.presses[j].label) {
        const Pose T_object_robot =
            inverse(simulated.T_object_robot[j]) * simulated.T_object_robot[i];
        counts.add(evidence_of(simulated.presses[i].touches, how.classifier()),
                   std::span(&T_object_robot, 1), layers[j]);
      }
    }
  }
  return counts;
}

TEST(TableLearning, CountsPressesAtKnownPosesWithinABinOfThem) {
  LetterPresses letters;
  letters.add("A", 6, 61);
  const std::vector<TrainingMap> maps =
      maps_by_folds(letters.presses, map_options(), 3).without_folds;
  TableLearning how = learning_on(maps);
  const std::vector<OccupancyGrid> layers = layers_of(maps, how.layer);
  const PlacedPresses placed = learn_table(letters.presses, maps, how);
  const auto counts = [&] {
    return count_placed(placed.placements, letters.presses, layers, how).at("A");
  };
  const LevelCounts exact = counts();
  how.counted_within = {.x_mm = 1.5, .y_mm = 0.9, .theta_rad = 0.3};
  const LevelCounts within = counts();
  EXPECT_NEAR(within.total(), exact.total(), 1e-9 * exact.total());

  // Anew, at the poses of the 27 bins about each press, turned about the middle of all presses.
  BoundingBox box;
  for (const Press& press : letters.presses) {
    box.take_in(press.T_object_robot->translation_mm);
  }
  const Pose about{box.middle(), 0.0};
  LevelCounts expected(2);
  for (const OwnPlacement& own : placed.placements) {
    const Press& press = letters.presses[own.press];
    const InterpolatedMap values(layers[own.map], layers[own.map].prior);
    const Touch& touch = press.touches.front();
    const std::vector<Reading> readings = how.classifier().classify(touch);
    for (int i = 0; i < 27; ++i) {
      const Pose turned{{}, (i % 3 - 1) * 0.1};
      const Pose moved{{(i / 3 % 3 - 1) * 0.5, (i / 9 - 1) * 0.3}, 0.0};
      const Pose T_object_sensor =
          moved * about * turned * inverse(about) * *press.T_object_robot * touch.T_robot_sensor;
      for (std::size_t e = 0; e < readings.size(); ++e) {
        expected.add(readings[e], values.log_odds(T_object_sensor * touch.elements_mm[e]),
                     1.0 / 27.0);
      }
    }
  }
  for (int node = 0; node < ReadingLayer::nodes; ++node) {
    EXPECT_NEAR(within.at(0, node), expected.at(0, node), 1e-6) << node;
    EXPECT_NEAR(within.at(1, node), expected.at(1, node), 1e-6) << node;
  }
}

TEST(TableLearning, RecoversTheTableOfASimulatedSensor) {
  // At known poses: readings are drawn from a table.
  OccupancyGrid layer = random_map(60, 60, 2.0, 8.0, 1);
  layer.prior = probability_from_log_odds(ReadingLayer::beyond);
  const auto truth = [](std::size_t level, double value) {
    const double contact = 0.05 + 0.9 / (1.0 + std::exp(-value));
    return level == 0 ? 1.0 - contact : level == 1 ? 0.7 * contact : 0.3 * contact;
  };
  TableLearning how{.level_edges = {10.0}, .contact = {.prior = 0.2}};
  how.contact.classifier = {.threshold = 2.0, .ratio = 0.1};
  Uniform random(2);
  Recording recording;
  recording.T_robot_sensor = {Pose{}};
  for (int i = 0; i < 100'000; ++i) {
    const int column = static_cast<int>(random(0.0, 60.0));
    const int row = static_cast<int>(random(0.0, 60.0));
    recording.elements_mm.push_back(layer.centre_mm(column, row));
    const double value = layer.at(column, row);
    const double at = random(0.0, 1.0);
    recording.pressure.push_back(at < truth(0, value)         ? 0.0
                                 : at < 1.0 - truth(2, value) ? 5.0
                                                              : 15.0);
  }
  LevelCounts counts(3);
  counts.add(evidence_of(all_touches(recording), how.classifier()), std::vector{Pose{}}, layer);
  const LearnedTable table = table_of({{"A", counts}}, how);
  for (std::size_t level = 0; level < 3; ++level) {
    for (int node = 17; node < 48; ++node) {
      const double value = -16.0 + 0.5 * node;
      const double p = std::exp(table.shared[level * 49 + static_cast<std::size_t>(node)]);
      // About 3000 readings a node: 3.5 standard errors.
      EXPECT_NEAR(p, truth(level, value), 0.032) << level << " at " << value;
    }
  }
}

TEST(TableLearning, FindsAtUnknownPosesWhatItWouldAtKnownOnes) {
  SimulatedPresses simulated;
  simulated.add_shapes(5, 3);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  const TableLearning how = learning_on(maps);
  double shown = 0.0;
  const PlacedPresses placed = learn_table(simulated.presses, maps, how, [&](double fraction) {
    EXPECT_GE(fraction, shown);
    shown = fraction;
  });
  EXPECT_EQ(shown, 1.0);
  EXPECT_EQ(placed.placements.size(), 40U);
  const LevelCounts counts = true_counts(simulated, maps, how);
  const std::vector<double> truth = shrunk_table(counts, how.initial().shared, 20.0);
  int compared = 0;
  for (int node = 0; node < ReadingLayer::nodes; ++node) {
    if (counts.at_node(node) > 150.0) {
      const auto at = 49 + static_cast<std::size_t>(node);
      EXPECT_NEAR(std::exp(placed.table.shared[at]), std::exp(truth[at]), 0.12) << node;
      ++compared;
    }
  }
  EXPECT_GT(compared, 5);
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
  TableLearning how = learning_on(maps);
  const Pose far{{1000.0, 0.0}, 0.0};
  const std::vector<OwnPlacement> placements{{0, 1, {Pose{}, -5.0, 0.0}}, {0, 2, {far, -9.0, 0.0}}};
  const auto counts = [&](std::size_t best_maps) {
    how.best_maps = best_maps;
    return count_placed(placements, simulated.presses, layers_of(maps, how.layer), how).at("disc");
  };
  EXPECT_NEAR(counts(1).total(), 196.0, 1e-9);
  EXPECT_EQ(counts(1).at_node(8), 0.0) << "no reading is beyond the map";
  EXPECT_NEAR(counts(3).at_node(8), 196.0, 1e-9);
}

TEST(TableLearning, ShrinksObjectsTowardsAllTogether) {
  TableLearning how{.contact = {.prior = 0.2}};
  ObjectCounts counts;
  for (const char* label : {"A", "B"}) {
    LevelCounts& own = counts.try_emplace(label, 2).first->second;
    for (int i = 0; i < 100; ++i) {
      own.add(*label == 'A' ? Reading::in_contact : Reading::no_contact, 0.0);
    }
  }
  const LearnedTable table = table_of(counts, how);
  const double eq7 = 0.5;  // at log odds 0 both readings are as likely
  const double shared = (100.0 + 20.0 * eq7) / 220.0;
  EXPECT_NEAR(std::exp(table.shared[49 + 32]), shared, 1e-12);
  EXPECT_NEAR(std::exp(table.objects.at("A")[49 + 32]), (100.0 + 200.0 * shared) / 300.0, 1e-12);
  EXPECT_NEAR(std::exp(table.objects.at("B")[49 + 32]), 200.0 * shared / 300.0, 1e-12);
  EXPECT_EQ(contact_with(how.contact, table, "C").table->log_likelihood, table.shared);
  EXPECT_EQ(contact_with(how.contact, table, "A").table->log_likelihood, table.objects.at("A"));
}

TEST(TableLearning, KeepsEquation7ForALevelThatNothingReached) {
  TableLearning how{.level_edges = {1000.0}, .contact = {.prior = 0.2}};
  LevelCounts counts(3);
  for (int i = 0; i < 80; ++i) {
    counts.add(Reading::in_contact, 0.0);
  }
  const LearnedTable table = table_of({{"A", counts}}, how);
  EXPECT_NEAR(std::exp(table.shared[2 * 49 + 32]), 20.0 * 0.25 / 100.0, 1e-12);
}

TEST(TableLearning, OfNoPairOfPressesIsRefused) {
  SimulatedPresses simulated;
  simulated.add_shapes(1, 5);
  const std::vector<TrainingMap> maps = maps_of_presses(simulated.presses, map_options());
  expect_named(input_error([&] { learn_table(simulated.presses, maps, learning_on(maps)); }),
               {"at least two touches of one object"});
}

TEST(TableLearning, CountsTouchesAtKnownPosesOnMapsOfTheOthers) {
  Recording recording = touches_of(on_letter_l, Pose{}, 40, 6);
  recording.object = "L";
  const std::vector<Press> presses = posed_presses(recording);
  const std::vector<TrainingMap> maps = maps_by_folds(presses, map_options(), 5).without_folds;
  ASSERT_EQ(maps.size(), 5U);
  const TableLearning how{.layer = {.near_mm = 3.0, .far_mm = 9.0}, .contact = {.prior = 0.2}};
  const PlacedPresses placed = learn_table(presses, maps, how);
  for (const OwnPlacement& own : placed.placements) {
    EXPECT_FALSE(maps[own.map].holds(own.press));
    const Pose T_object_sensor =
        own.placement.T_object_robot * presses[own.press].touches[0].T_robot_sensor;
    EXPECT_NEAR(T_object_sensor.translation_mm.x,
                recording.T_robot_sensor[own.press].translation_mm.x, 1e-12);
  }
  const LevelCounts counts =
      count_placed(placed.placements, presses, layers_of(maps, how.layer), how).at("L");
  EXPECT_NEAR(counts.total(), 40.0 * 36.0, 1e-6);
  // The touches are without error: where maps of the others are sure, they are right.
  double wrong = 0.0;
  double sure = 0.0;
  for (int node = 0; node < ReadingLayer::nodes; ++node) {
    const double value = ReadingLayer::first_node + 0.5 * node;
    if (std::abs(value) >= 6.0 && value >= -8.0) {
      wrong += counts.at(value > 0.0 ? 0 : 1, node);
      sure += counts.at_node(node);
    }
  }
  EXPECT_GT(sure, 300.0);
  EXPECT_LT(wrong, 0.08 * sure);
}

TEST(TableLearning, OfOneFoldHasNoMapsOfOthers) {
  Recording recording = touches_of(on_letter_l, Pose{}, 4, 6);
  const std::vector<Press> presses = posed_presses(recording);
  EXPECT_TRUE(maps_by_folds(presses, map_options(), 1).without_folds.empty());
  EXPECT_THROW(learn_table(presses, {}, {.contact = {.prior = 0.2}}), Error);
}

}  // namespace palpate::table_learning_test
