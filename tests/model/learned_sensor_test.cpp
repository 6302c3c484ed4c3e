#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "palpate/learned_sensor.hpp"
#include "support/errors.hpp"

namespace palpate::learned_sensor_test {

/// A map in which a share of the cells was sensed.
OccupancyGrid sparse_map(int nx, int ny, double share, unsigned seed) {
  OccupancyGrid map;
  map.label = "A";
  map.cell_mm = 0.75;
  map.origin_mm = {-3.0, 4.5};
  map.nx = nx;
  map.ny = ny;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int k = 0; k < nx * ny; ++k) {
    const bool sensed = uniform(random) < share;
    map.observations.push_back(sensed ? 1.0F : 0.0F);
    map.log_odds.push_back(sensed ? static_cast<float>(30.0 * uniform(random) - 15.0)
                                  : static_cast<float>(map.prior_log_odds()));
    map.mean_level.push_back(sensed ? static_cast<float>(300.0 * uniform(random)) : 0.0F);
  }
  return map;
}

TEST(ReadingLayer, HoldsTheDefinitionInEveryCell) {
  const ReadingLayer settings{.near_mm = 1.6, .far_mm = 4.1};
  for (unsigned seed = 0; seed < 20; ++seed) {
    const OccupancyGrid map =
        sparse_map(3 + static_cast<int>(seed), 11, seed % 2 == 0 ? 0.05 : 0.4, seed);
    const OccupancyGrid layer = reading_layer(map, settings);
    EXPECT_EQ(layer.cell_mm, map.cell_mm);
    EXPECT_NEAR(layer.prior_log_odds(), ReadingLayer::beyond, 1e-9);
    const int border = (layer.nx - map.nx) / 2;
    EXPECT_EQ(layer.ny, map.ny + 2 * border);
    EXPECT_GE(border * map.cell_mm, settings.far_mm);
    EXPECT_EQ(layer.centre_mm(border, border), map.centre_mm(0, 0));
    for (int j = 0; j < layer.ny; ++j) {
      for (int i = 0; i < layer.nx; ++i) {
        double nearest = INFINITY;
        double value = ReadingLayer::beyond;
        bool tie = false;  // of a free and an occupied cell: either may count
        bool occupied = false;
        for (int l = 0; l < map.ny; ++l) {
          for (int k = 0; k < map.nx; ++k) {
            const auto at = static_cast<std::size_t>(l) * map.nx + k;
            if (map.observations[at] > 0.0F) {
              const double mm = std::hypot(i - border - k, j - border - l) * map.cell_mm;
              const bool here = map.log_odds[at] > 0.0F;
              tie = mm < nearest ? false : tie || (mm == nearest && here != occupied);
              occupied = mm < nearest ? here : occupied;
              value = mm == 0.0 ? std::clamp(double{map.log_odds[at]}, -8.0, 8.0) : value;
              nearest = std::min(nearest, mm);
            }
          }
        }
        if (nearest > 0.0 && nearest <= settings.far_mm) {
          value =
              nearest <= settings.near_mm ? (occupied ? -15.0 : -10.0) : (occupied ? -14.0 : -11.0);
        }
        if (!tie) {
          ASSERT_NEAR(layer.at(i, j), value, 1e-6) << seed << ": " << i << ", " << j;
        }
      }
    }
  }
}

TEST(ReadingLayer, ScalesMeanLevelsByTheirLogarithm) {
  OccupancyGrid map = sparse_map(4, 1, 1.0, 1);
  map.mean_level = {0.0F, 1.0F, 255.0F, 1000.0F};
  const OccupancyGrid layer =
      reading_layer(map, {.of = MapLayer::mean_level, .near_mm = 0.0, .far_mm = 0.0});
  ASSERT_EQ(layer.nx, 6);
  EXPECT_NEAR(layer.at(1, 1), -8.0, 1e-6);
  EXPECT_NEAR(layer.at(2, 1), 16.0 * std::log(2.0) / std::log(256.0) - 8.0, 1e-6);
  EXPECT_NEAR(layer.at(3, 1), 8.0, 1e-6);
  EXPECT_NEAR(layer.at(4, 1), 8.0, 1e-6) << "clamped";
}

TEST(ReadingLayer, TakesThePriorForUnseenWhereNothingWasCounted) {
  OccupancyGrid map = sparse_map(5, 1, 1.0, 2);
  map.observations.clear();
  map.log_odds = {1.0F, static_cast<float>(map.prior_log_odds()), -2.0F, -3.0F, 4.0F};
  const OccupancyGrid layer = reading_layer(map, {.near_mm = 1.0, .far_mm = 1.0});
  const int border = (layer.nx - map.nx) / 2;
  EXPECT_EQ(layer.at(border, border), 1.0F);
  EXPECT_LT(layer.at(border + 1, border), -8.0F);
  EXPECT_EQ(layer.at(border + 2, border), -2.0F);
}

TEST(ReadingLayer, RefusesWhatCannotBe) {
  OccupancyGrid map = sparse_map(5, 5, 0.5, 3);
  for (const ReadingLayer& settings :
       {ReadingLayer{.near_mm = 5.0, .far_mm = 4.0}, {.unit_level = 0.0}, {.far_mm = 1e6}}) {
    input_error([&] { reading_layer(map, settings); });
  }
  map.mean_level.clear();
  expect_named(input_error([&] { reading_layer(map, {.of = MapLayer::mean_level}); }), {"'A'"});
}

OccupancyGrid map_of(const std::string& label) {
  return {.label = label,
          .cell_mm = 2.0,
          .origin_mm = {-2.0, 4.0},
          .nx = 3,
          .ny = 2,
          .log_odds = {1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F},
          .observations = {1.0F, 0.0F, 3.0F, 4.0F, 5.0F, 6.0F},
          .mean_level = {10.0F, 0.0F, 30.0F, 40.0F, 50.0F, 60.0F}};
}

LearnedSensor sensor_of_two_levels() {
  LearnedSensor sensor{.classifier = {.threshold = 5.0, .ratio = 0.2}, .gamma = 0.3};
  sensor.table = LearnedTable{};
  sensor.table->shared.assign(2 * ReadingLayer::nodes, -1.0);
  return sensor;
}

TEST(Apply, WithoutATableSetsWhatEquation7Needs) {
  LearnedSensor sensor = sensor_of_two_levels();
  std::vector<Hypothesis> hypotheses{{map_of("A")}};
  ContactModel contact;
  apply(sensor, hypotheses, contact);
  sensor.table.reset();
  contact.prior = 0.4;
  apply(sensor, hypotheses, contact);
  EXPECT_EQ(contact.classifier.threshold, 5.0);
  EXPECT_EQ(contact.classifier.ratio, 0.2);
  EXPECT_EQ(contact.gamma, 0.3);
  EXPECT_EQ(contact.prior, 0.4);
  EXPECT_FALSE(contact.table) << "nor the table of a sensor before";
  EXPECT_FALSE(hypotheses[0].layer);
}

TEST(Apply, GivesLayersAndEachObjectItsOwnNumbersOrTheShared) {
  LearnedSensor sensor = sensor_of_two_levels();
  std::vector<Hypothesis> hypotheses{{map_of("A")}, {map_of("B")}, {map_of("B")}};
  for (const char* label : {"other", "B"}) {
    sensor.table->objects[label].assign(2 * ReadingLayer::nodes, -2.0);
    ContactModel contact{.prior = 0.4};
    apply(sensor, hypotheses, contact);
    ASSERT_TRUE(contact.table);
    EXPECT_EQ(contact.table->sets(), *label == 'B' ? 3u : 1u) << "one where none has its own";
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(contact.log_likelihood(Reading::in_contact, {0.3}, i),
                *label == 'B' && i > 0 ? -2.0 : -1.0);
    }
    EXPECT_EQ(contact.table->first_log_odds, ReadingLayer::first_node);
    EXPECT_FALSE(contact.prior) << "that of the layers";
  }
  const OccupancyGrid expected = reading_layer(hypotheses[1].map, sensor.table->layer);
  ASSERT_TRUE(hypotheses[1].layer);
  EXPECT_EQ(hypotheses[1].layer->log_odds, expected.log_odds);
  EXPECT_EQ(hypotheses[1].compared().prior, expected.prior);
}

TEST(Apply, ChangesNothingWhereAMapLacksItsLayer) {
  LearnedSensor sensor = sensor_of_two_levels();
  sensor.table->layer.of = MapLayer::mean_level;
  std::vector<Hypothesis> hypotheses{{map_of("A")}, {map_of("B")}};
  hypotheses[1].map.mean_level.clear();
  ContactModel contact{.prior = 0.4};
  input_error([&] { apply(sensor, hypotheses, contact); });
  EXPECT_FALSE(hypotheses[0].layer || contact.table);
  EXPECT_EQ(contact.prior, 0.4);
  sensor.temperature = 0.0;
  expect_named(input_error([&] { apply(sensor, hypotheses, contact); }), {"temperature"});
}

TEST(LearnedSensor, RefusesALogProbabilityAbove0) {
  for (const bool own : {false, true}) {
    LearnedSensor sensor = sensor_of_two_levels();
    std::vector<double>& numbers = own ? sensor.table->objects["A"] : sensor.table->shared;
    numbers.assign(2 * ReadingLayer::nodes, -1.0);
    numbers[ReadingLayer::nodes + 3] = 0.0;
    sensor.validate();
    numbers[ReadingLayer::nodes + 3] = 5.0;
    expect_named(input_error([&] { sensor.validate(); }), {"table: number [1, 3] = 5"});
  }
}

TEST(MirrorImage, TurnsEveryLayerOfTheMapAround) {
  const OccupancyGrid map = map_of("A");
  const OccupancyGrid image = mirror_image(map);
  EXPECT_EQ(image.origin_mm, glm::dvec2(-2.0, 4.0)) << "cells at x = -2, 0 and 2";
  EXPECT_EQ(image.log_odds, (std::vector{3.0F, 2.0F, 1.0F, 6.0F, 5.0F, 4.0F}));
  EXPECT_EQ(image.observations, (std::vector{3.0F, 0.0F, 1.0F, 6.0F, 5.0F, 4.0F}));
  EXPECT_EQ(image.mean_level, (std::vector{30.0F, 0.0F, 10.0F, 60.0F, 50.0F, 40.0F}));
  OccupancyGrid aside = map;
  aside.origin_mm.x = 10.0;
  aside.observations.clear();
  EXPECT_EQ(mirror_image(aside).origin_mm.x, -14.0) << "the cell at 14";
  EXPECT_TRUE(mirror_image(aside).observations.empty());
  EXPECT_EQ(mirror_image(mirror_image(aside)).log_odds, aside.log_odds);
  EXPECT_EQ(mirror_image(mirror_image(aside)).origin_mm, aside.origin_mm);
}

TEST(AddMirrorImages, HalvesTheWeightOfWhatMayLieOnEitherSide) {
  std::vector<Hypothesis> hypotheses{{map_of("A"), 3.0}, {map_of("B"), 5.0}};
  hypotheses[0].map.mirror = true;
  add_mirror_images(hypotheses);
  ASSERT_EQ(hypotheses.size(), 3u);
  EXPECT_EQ(hypotheses[0].weight, 1.5);
  EXPECT_EQ(hypotheses[1].weight, 1.5);
  EXPECT_EQ(hypotheses[2].weight, 5.0);
  EXPECT_FALSE(hypotheses[0].mirrored || hypotheses[2].mirrored);
  EXPECT_TRUE(hypotheses[1].mirrored && hypotheses[1].map.mirror);
  EXPECT_EQ(hypotheses[1].map.label, "A");
  EXPECT_EQ(hypotheses[1].map.log_odds, mirror_image(hypotheses[0].map).log_odds);
}

TEST(PressFeatures, AreLogarithmsOfAreaForceAndPeak) {
  const std::vector<glm::dvec2> elements_mm(5);
  const std::vector<double> pressure{10.0, 0.5, 4.0, -1.0, 99.0};
  const std::vector<std::uint8_t> valid{1, 1, 1, 1, 0};
  const Touch touch{
      .T_robot_sensor = {}, .elements_mm = elements_mm, .pressure = pressure, .valid = valid};
  // Two elements in contact, 14.5 kPa in all, 10 kPa at most; the threshold is 2 kPa.
  const auto [area, force, peak] = press_features(touch, {}).values;
  EXPECT_DOUBLE_EQ(area, std::log(3.0));
  EXPECT_DOUBLE_EQ(force, std::log(8.25));
  EXPECT_DOUBLE_EQ(peak, std::log(6.0));
}

TEST(FeatureDistribution, HasTheDensityOfItsCovariance) {
  FeatureDistribution distribution{
      .mean = {1.0, 2.0, 3.0}, .sd = {0.5, 2.0, 1.5}, .correlation = {0.6, -0.3, 0.2}};
  // -z^T C^-1 z / 2 - log sqrt((2 pi)^3 det C) - log of the product of sds; C^-1 by its cofactors.
  const double det = 1.0 + 2.0 * 0.6 * -0.3 * 0.2 - 0.36 - 0.09 - 0.04;
  const double z[3] = {1.0, -0.5, 2.0};
  const double cofactor[3][3] = {{1.0 - 0.04, -0.3 * 0.2 - 0.6, 0.6 * 0.2 + 0.3},
                                 {-0.3 * 0.2 - 0.6, 1.0 - 0.09, -0.3 * 0.6 - 0.2},
                                 {0.6 * 0.2 + 0.3, -0.3 * 0.6 - 0.2, 1.0 - 0.36}};
  double expected = -1.5 * std::log(2.0 * std::numbers::pi) - 0.5 * std::log(det) - std::log(1.5);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      expected -= 0.5 * z[i] * cofactor[i][j] / det * z[j];
    }
  }
  EXPECT_NEAR(distribution.log_density({{1.5, 1.0, 6.0}}), expected, 1e-12);
  distribution.correlation = {0.9, 0.9, -0.9};
  EXPECT_TRUE(std::isnan(distribution.log_density({{1.5, 1.0, 6.0}}))) << "no covariance";
}

}  // namespace palpate::learned_sensor_test
