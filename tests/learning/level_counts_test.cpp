#include "learning/level_counts.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "palpate/error.hpp"

namespace palpate::level_counts_test {

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
  EXPECT_DOUBLE_EQ(counts.total(), 3.0);
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
  const Touch touch{{}, elements, pressure};
  ContactModel model{.classifier = {.threshold = 2.0, .ratio = 0.1}};
  model.table = LikelihoodTable{.nodes = 49, .level_edges = {30.0}, .log_likelihood = {}};
  LevelCounts counts(3);
  // The object is moved by -1 mm along x, so that elements 1 and 2 lie on the layer's cells.
  const Pose T_object_robot{{-1.0, 0.0}, 0.0};
  counts.add(evidence_of(std::span(&touch, 1), model), std::span(&T_object_robot, 1), layer);
  EXPECT_DOUBLE_EQ(counts.at(1, node_of(-3.0)), 1.0);
  EXPECT_DOUBLE_EQ(counts.at(2, node_of(5.0)), 1.0);
  EXPECT_DOUBLE_EQ(counts.at(0, node_of(-12.0)), 2.0) << "beyond the layer";
}

TEST(InitialTable, IsEquation7OverLogOdds) {
  const ContactModel contact{.gamma = 0.2, .prior = 0.1};
  const std::vector<double> table = initial_table({}, 2, contact);
  ASSERT_EQ(table.size(), 98U);
  const auto p = [&](std::size_t level, double value) {
    return std::exp(table[level * 49 + static_cast<std::size_t>(node_of(value))]);
  };
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
  const ContactModel contact{.classifier = {.threshold = 15.0}, .gamma = 0.0, .prior = 0.1};
  const ReadingLayer layer = mean_level_layer(15.0, 255.0);
  EXPECT_DOUBLE_EQ(layer.unit_level, 1.0);
  const std::vector<double> table = initial_table(layer, 4, contact);
  const auto p = [&](std::size_t level, double value) {
    return std::exp(table[level * 49 + static_cast<std::size_t>(node_of(value))]);
  };
  EXPECT_NEAR(p(0, 0.0), 0.5, 1e-12);
  EXPECT_NEAR(p(3, 0.0), 0.5 / 3.0, 1e-12);
  EXPECT_NEAR(p(0, 3.0), 1.0 / (1.0 + std::exp(3.0)), 1e-12);
}

TEST(MeanLevelLayer, TakesAnyPressure) {
  EXPECT_DOUBLE_EQ(mean_level_layer(2.0, 0.0).unit_level, 2.0);
  EXPECT_DOUBLE_EQ(mean_level_layer(2.0, 0.0).full_level, 6.0);
  EXPECT_THROW(mean_level_layer(0.0, 255.0), Error);
}

TEST(ShrunkTable, AddsPseudoCounts) {
  LevelCounts counts(2);
  for (int i = 0; i < 30; ++i) {
    counts.add(i < 24 ? Reading::in_contact : Reading::no_contact, 1.0);
  }
  // Twice the probabilities: they are normalised.
  const std::vector<double> towards(98, std::log(1.0));
  const std::vector<double> table = shrunk_table(counts, towards, 20.0);
  const auto at = static_cast<std::size_t>(node_of(1.0));
  EXPECT_NEAR(std::exp(table[at]), (6.0 + 10.0) / 50.0, 1e-12);
  EXPECT_NEAR(std::exp(table[49 + at]), (24.0 + 10.0) / 50.0, 1e-12);
  EXPECT_NEAR(std::exp(table[0]), 0.5, 1e-12) << "a node without counts keeps what it had";
}

TEST(ShrunkTable, HasAFloor) {
  LevelCounts counts(2);
  counts.add(Reading::no_contact, 0.0);
  std::vector<double> towards(98, 0.0);
  for (std::size_t node = 0; node < 49; ++node) {
    towards[49 + node] = -100.0;
  }
  const std::vector<double> table = shrunk_table(counts, towards, 20.0);
  EXPECT_DOUBLE_EQ(table[49], std::log(1e-6));
  EXPECT_DOUBLE_EQ(table[49 + static_cast<std::size_t>(node_of(0.0))], std::log(1e-6));
}

}  // namespace palpate::level_counts_test
